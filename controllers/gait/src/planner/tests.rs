//! Tests of the complete controller, with a robot whose feet do not slip.

use std::f64::consts::PI;

use twinrig_kernel::{Direction, SimDuration, Snapshot};
use twinrig_robot::leg::{LegCommand, Pantograph};
use twinrig_robot::{LegMount, Robot};
use twinrig_runtime::{Process, ProcessVariable};

use super::Planner;
use crate::{Cpg, Gait};

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
const PERIOD: SimDuration = SimDuration::from_millis(2);
/// Duty factor of the tests: two feet stand at any time, and all of them when a pair lands.
const DUTY: f64 = 0.6;

fn set(process: &mut impl Process, name: &str, value: f64) {
    let mut names = process.variables().iter().map(ProcessVariable::name);
    let index = names.position(|known| known == name).unwrap();
    process.set_variable(index, value).unwrap();
}

fn planner() -> Planner {
    let robot = Robot::example();
    let cpg = Cpg::new(&robot, &LEGS, Gait::Trot).unwrap();
    let mut planner = Planner::new(&robot, &LEGS, cpg).unwrap();
    set(&mut planner, "duty_factor/fore", DUTY);
    set(&mut planner, "duty_factor/hind", DUTY);
    set(&mut planner, "modulation_slope", 1.0 / DUTY);
    planner
}

/// A robot that follows its commands, with level feet of equal load in the stance of its gait.
struct Walker {
    legs: Vec<Pantograph>,
    planner: Planner,
    outputs: [f64; 10],
    /// Angles and loads of all legs.
    inputs: [f64; 16],
    trunk: f64,
    footfalls: Vec<f64>,
    allocations: u64,
}

impl Walker {
    fn new(planner: Planner) -> Self {
        let leg = |mount: &LegMount| Pantograph::new(&mount.leg).unwrap();
        Self {
            legs: Robot::example().legs.iter().map(leg).collect(),
            planner,
            outputs: [0.0; 10],
            inputs: [0.0; 16],
            trunk: 0.0,
            footfalls: Vec::new(),
            allocations: 0,
        }
    }

    fn step(&mut self, elapsed: SimDuration) {
        let (planner, before, outputs) = (&mut self.planner, self.inputs, &mut self.outputs);
        let counted = allocation_counter::measure(|| planner.step(elapsed, &before, outputs));
        self.allocations += counted.count_total;
        let (mut advance, mut standing) = (0.0, 0.0);
        for (n, leg) in self.legs.iter().enumerate() {
            let [hip, knee] = [outputs[2 * n], outputs[2 * n + 1]];
            let place = |angles: [f64; 3]| planner.limbs[n].1.place_of(angles);
            let now = angles(leg, hip, knee);
            let stands = planner.gait.phase(n) >= PI;
            let stood = before[12 + n] > 0.0;
            if stands && stood {
                advance += place([0, 1, 2].map(|m| before[3 * n + m])) - place(now);
                standing += 1.0;
            }
            self.inputs[3 * n..3 * n + 3].copy_from_slice(&now);
            self.inputs[12 + n] = if stands { 5.0 } else { 0.0 };
            if stands && !stood && elapsed > SimDuration::ZERO {
                self.footfalls.push(self.trunk + place(now));
            }
        }
        if standing > 0.0 {
            self.trunk += advance / standing;
        }
    }

    fn walk(&mut self, seconds: u64) {
        self.step(SimDuration::ZERO);
        for _ in 0..500 * seconds {
            self.step(PERIOD);
        }
    }

    /// Footfalls within the section of the way.
    fn hits(&self, near: f64, far: f64) -> usize {
        let hits = self.footfalls.iter().filter(|&&x| x > near && x < far);
        hits.count()
    }
}

/// Angles of the segments of a leg whose pantograph is closed.
fn angles(leg: &Pantograph, hip: f64, knee: f64) -> [f64; 3] {
    let foot = leg.foot_of(LegCommand { hip, knee }).unwrap();
    let first = hip + leg.hip_reference();
    let pose = leg.pose(libm::sin(first), libm::cos(first), foot);
    pose.unwrap().angles()
}

#[test]
fn no_foot_lands_in_an_obstacle_wherever_it_is_and_iterations_do_not_allocate() {
    let (mut blind, mut planned) = (0, 0);
    for n in 0..8 {
        let near = 1.5 + 0.16 * f64::from(n) / 8.0;
        for most in [0.0, 0.02] {
            let mut planner = planner();
            set(&mut planner, "obstacle_distance", near);
            set(&mut planner, "obstacle_length", 0.025);
            set(&mut planner, "step_change_max", most);
            let mut walker = Walker::new(planner);
            walker.walk(6);
            assert_eq!(walker.allocations, 0);
            assert!(walker.trunk > near + 0.3, "{}", walker.trunk);
            let hits = walker.hits(near, near + 0.025);
            *(if most > 0.0 { &mut planned } else { &mut blind }) += usize::from(hits > 0);
        }
    }
    assert!(blind >= 3, "{blind}");
    assert_eq!(planned, 0);
}

#[test]
fn distance_is_that_of_the_trunk() {
    let mut walker = Walker::new(planner());
    walker.walk(4);
    let estimate = walker.outputs[8];
    assert!((estimate - walker.trunk).abs() < 0.01, "{estimate}");
    assert!(walker.trunk > 1.0);
}

#[test]
fn inputs_are_joint_angles_and_loads_and_nothing_else() {
    let planner = planner().with_load("force-*/force", Some(2)).unwrap();
    let ports = planner.ports();
    let inputs = ports
        .iter()
        .filter(|port| port.direction == Direction::Input);
    let names: Vec<&str> = inputs.map(|port| port.name.as_str()).collect();
    let angles = LEGS.map(|leg| format!("leg/{leg}/angles"));
    let loads = LEGS.map(|leg| format!("force-{leg}/force"));
    assert_eq!(names, [angles, loads].concat());
}

#[test]
fn blind_steps_are_those_of_the_gait_bit_for_bit() {
    let mut gait = planner().gait;
    let mut planner = planner();
    set(&mut planner, "obstacle_length", 0.025);
    set(&mut planner, "obstacle_distance", 0.5);
    set(&mut planner, "step_change_max", 0.0);
    let mut walker = Walker::new(planner);
    walker.walk(3);
    let mut expected = [0.0; 8];
    gait.step(SimDuration::ZERO, &[], &mut expected);
    for _ in 0..1500 {
        gait.step(PERIOD, &[], &mut expected);
    }
    assert_eq!(walker.outputs[..8], expected);
}

#[test]
fn continues_from_a_snapshot_bit_for_bit() {
    let mut planner = planner();
    set(&mut planner, "obstacle_distance", 1.3);
    set(&mut planner, "obstacle_length", 0.025);
    set(&mut planner, "step_length_offset/LF", 0.001);
    let mut walker = Walker::new(planner);
    walker.walk(3);
    assert_ne!(walker.outputs[9], 0.0);
    let saved = walker.planner.save();
    let mut restored = Walker::new(self::planner());
    restored.planner.restore(&saved).unwrap();
    (restored.inputs, restored.outputs) = (walker.inputs, walker.outputs);
    for _ in 0..1000 {
        walker.step(PERIOD);
        restored.step(PERIOD);
        assert_eq!(walker.outputs, restored.outputs);
    }
    assert!(restored.planner.restore(&Snapshot::of(&1_u8)).is_err());
}
