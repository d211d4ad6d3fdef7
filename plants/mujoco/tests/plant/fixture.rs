//! Fixture: the robot in motion, with its inputs and outputs.

use std::path::Path;

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_legged::{Base, Drives, Setup, Start, StartPose};
use twinrig_mujoco::{Coordinates, Mujoco, Options};
use twinrig_robot::{Robot, RobotFile, Servo};
use twinrig_runtime::{Plant, PlantFault};

pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// A servo sufficient for a trot.
pub const SERVO: Servo = Servo {
    torque: 5.0,
    speed: 20.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-4,
};

/// Returns a robot of `robots/`.
pub fn robot_named(name: &str) -> Robot {
    let near = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    RobotFile::find(name, near).unwrap().robot().unwrap()
}

pub fn robot() -> Robot {
    robot_named("cheetah-cub")
}

/// Returns a pose from angles in degrees and rates in rad/s.
pub fn pose(q: [f64; 3], rates: [f64; 3]) -> Start {
    let q = q.map(f64::to_radians);
    StartPose { q, rates }.into()
}

pub fn flat(friction: f64) -> Ground {
    Ground::new(Terrain::Flat, friction, 0.0).unwrap()
}

/// Returns the setup of legs that hang from a fixed trunk, without drives.
pub fn hanging(start: Start) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        start,
    }
}

/// Returns the setup of the free robot on flat ground, with servos.
pub fn standing() -> Setup {
    Setup {
        base: Base::Free,
        ground: Some(flat(0.6)),
        drives: Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        },
        ..hanging(Start::default())
    }
}

/// A plant with its inputs and outputs.
pub struct Fixture {
    pub plant: Mujoco,
    pub inputs: Vec<f64>,
    layout: Layout,
    outputs: Vec<f64>,
    now: SimTime,
}

impl Fixture {
    pub fn new(robot: &Robot, options: &Options) -> Self {
        let plant = Mujoco::new(robot, options, &|_| true).unwrap();
        let layout = Layout::of(&plant.ports(), Direction::Output);
        let count = Layout::of(&plant.ports(), Direction::Input).len();
        let mut inputs = vec![0.0; count];
        plant.initial_inputs(&mut inputs);
        Self {
            outputs: vec![0.0; layout.len()],
            plant,
            inputs,
            layout,
            now: SimTime::ZERO,
        }
    }

    pub fn of(setup: Setup, coordinates: Coordinates) -> Self {
        Self::new(&robot(), &Options::new(setup, coordinates))
    }

    /// Shifts the time of the fixture, for a plant that was restored.
    pub fn shift_time_us(&mut self, us: u64) {
        self.now += SimDuration::from_micros(us);
    }

    /// Advances by a number of microseconds.
    pub fn advance_us(&mut self, us: u64) {
        self.try_advance_us(us).unwrap();
    }

    /// Advances by a number of microseconds. Returns the fault, if any.
    pub fn try_advance_us(&mut self, us: u64) -> Result<(), PlantFault> {
        self.now += SimDuration::from_micros(us);
        self.plant.advance(self.now, &self.inputs)
    }

    pub fn read(&mut self, signal: &str) -> Vec<f64> {
        self.plant.observe(&mut self.outputs);
        self.outputs[self.layout.find(signal).unwrap()].to_vec()
    }

    pub fn all(&mut self) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        &self.outputs
    }
}
