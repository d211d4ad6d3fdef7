//! Fixture: robots, setups and plants of the tests.

use std::fs;
use std::path::Path;

use serde_json::Value;
use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Setup, Start, StartPose};
use twinrig_rapier::{Joints, Options, Rapier};
use twinrig_robot::{Robot, RobotFile};
use twinrig_runtime::Plant;

/// A trajectory of `plants/lcp/tests/reference`: other coordinates, integrators and language, with
/// errors below 1e-9 m.
pub struct Golden(pub Value);

impl Golden {
    pub fn read(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lcp/tests/reference/golden");
        let text = fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        Self(serde_json::from_str(&text).unwrap())
    }

    pub fn number(&self, key: &str) -> f64 {
        self.0[key].as_f64().unwrap()
    }

    /// Returns rows of numbers, one for each instant; deeper nesting is flattened.
    pub fn rows(&self, key: &str) -> Vec<Vec<f64>> {
        self.0[key].as_array().unwrap().iter().map(flat).collect()
    }

    /// Returns joint angles and rates at the start.
    pub fn start(&self) -> StartPose {
        let three = |value: &Value| <[f64; 3]>::try_from(flat(value)).unwrap();
        StartPose {
            q: three(&self.0["start"]["angles_deg"]).map(f64::to_radians),
            rates: three(&self.0["start"]["rates"]),
        }
    }

    /// Returns the robot with the leg of a passive reference.
    pub fn robot(&self) -> Robot {
        let mut robot = robot();
        let parameter = |key: &str| self.0["leg"][key].as_f64().unwrap();
        let leg = &mut robot.legs[0].leg;
        (leg.diagonal.stiffness, leg.parallel.stiffness) = (parameter("k_d"), parameter("k_p"));
        (leg.diagonal.preload, leg.parallel.preload) =
            (parameter("preload_d"), parameter("preload_p"));
        leg.parallel_travel = parameter("travel");
        let friction = flat(&self.0["leg"]["friction"]);
        let joints = &mut leg.joint_friction;
        (joints.hip, joints.knee, joints.ankle) = (friction[0], friction[1], friction[2]);
        robot
    }
}

pub fn flat(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(items) => items.iter().flat_map(flat).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}

pub fn robot() -> Robot {
    named("cheetah-cub")
}

pub fn named(name: &str) -> Robot {
    let near = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    RobotFile::find(name, near).unwrap().robot().unwrap()
}

/// Returns the setup of legs that hang from a fixed trunk.
pub fn hanging(legs: &[&str], start: StartPose, step_us: u64) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: legs.iter().map(|leg| (*leg).to_owned()).collect(),
        ground: None,
        step: SimDuration::from_micros(step_us),
        drives: Drives::None,
        start: start.into(),
    }
}

/// Returns the setup of the robot on flat ground with ideal drives.
pub fn standing(step_us: u64) -> Setup {
    Setup {
        base: Base::Free,
        legs: ["LF", "RF", "LH", "RH"].map(str::to_owned).to_vec(),
        ground: Some(Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_micros(step_us),
        drives: Drives::Ideal { period: 2e-3 },
        start: Start::default(),
    }
}

/// A plant with its signals by name, its time and its commands.
pub struct Fixture {
    pub plant: Rapier,
    layout: Layout,
    pub now_us: u64,
    pub commands: Vec<f64>,
}

impl Fixture {
    pub fn new(robot: &Robot, options: &Options) -> Self {
        let plant = Rapier::new(robot, options, &|_| true).unwrap();
        let ports = plant.ports();
        let mut commands = vec![0.0; Layout::of(&ports, Direction::Input).len()];
        plant.initial_inputs(&mut commands);
        Self {
            layout: Layout::of(&ports, Direction::Output),
            plant,
            now_us: 0,
            commands,
        }
    }

    pub fn of(robot: &Robot, setup: Setup, joints: Joints) -> Self {
        Self::new(robot, &Options::new(setup, joints))
    }

    /// Advances to an instant. Returns whether the plant reached it without a fault.
    pub fn reaches_us(&mut self, us: u64) -> bool {
        let at = SimTime::ZERO + SimDuration::from_micros(us);
        let reached = us <= self.now_us || self.plant.advance(at, &self.commands).is_ok();
        self.now_us = us;
        reached
    }

    /// Advances to an instant of nanosecond resolution.
    pub fn run_to_ns(&mut self, ns: u64) {
        let at = SimTime::ZERO + SimDuration::from_nanos(ns);
        self.plant.advance(at, &self.commands).unwrap();
    }

    pub fn run_to_us(&mut self, us: u64) {
        assert!(self.reaches_us(us), "a fault before {us} µs");
    }

    pub fn read(&mut self, signal: &str) -> Vec<f64> {
        let mut outputs = vec![0.0; self.layout.len()];
        self.plant.observe(&mut outputs);
        outputs[self.layout.find(signal).unwrap()].to_vec()
    }

    pub fn all(&mut self) -> Vec<f64> {
        let mut outputs = vec![0.0; self.layout.len()];
        self.plant.observe(&mut outputs);
        outputs
    }
}
