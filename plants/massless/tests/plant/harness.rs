//! Test harness: a plant with its commands and signals. Used by the tests and the benchmark.

use std::path::Path;

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_leg::{LegCommand, Pantograph, Planar};
use twinrig_legged::{Base, Drives, Setup, Start};
use twinrig_massless::{Force, Massless, Options};
use twinrig_robot::{Robot, RobotFile, Servo};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault};

/// The robot of `robots/cheetah-cub.toml`.
pub fn robot() -> Robot {
    named_robot("cheetah-cub")
}

/// A robot of this repository.
pub fn named_robot(name: &str) -> Robot {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    RobotFile::find(name, root).unwrap().robot().unwrap()
}

/// A servo that is strong enough for a trot.
pub const SERVO: Servo = Servo {
    torque: 4.0,
    speed: 25.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-3,
};

/// All four legs, free, on flat ground, in steps of a millisecond.
pub fn setup() -> Setup {
    Setup {
        base: Base::Free,
        legs: ["LF", "RF", "LH", "RH"].map(str::to_owned).to_vec(),
        ground: Some(Ground::new(Terrain::Flat, 0.6, 0.0).unwrap()),
        step: SimDuration::from_millis(1),
        drives: Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        },
        start: Start::default(),
    }
}

/// The same on a plane that descends towards +x by `slope` metres per metre, with the trunk level
/// and all feet on it.
pub fn on_slope(robot: &Robot, slope: f64, friction: f64) -> Setup {
    const SPACING: f64 = 0.2;
    let hips = robot.legs.iter().map(|mount| mount.hip[0]);
    let foremost = hips.fold(f64::NEG_INFINITY, f64::max);
    let height = |x: f64| -slope * (x - foremost);
    let heights = (0..40 * 40).map(|i| height(SPACING * f64::from(i % 40 - 20)));
    let origin = [-20.0 * SPACING; 2];
    let field = HeightField::new(origin, SPACING, 40, heights.collect()).unwrap();
    let ground = Ground::new(Terrain::Heights(field), friction, 0.0).unwrap();
    let start = robot.legs.iter().map(|mount| {
        let leg = Pantograph::new(&mount.leg).unwrap();
        let length = 0.95 * leg.length_max() - height(mount.hip[0]);
        let command = leg.inverse_closed(Planar::new(0.0, -length)).unwrap();
        (mount.name.clone(), command)
    });
    Setup {
        ground: Some(ground),
        start: start.collect(),
        ..setup()
    }
}

/// A plant with its commands, and buffers for its signals.
#[derive(Clone, Debug)]
pub struct Harness {
    pub plant: Massless,
    pub commands: Vec<f64>,
    layout: Layout,
    outputs: Vec<f64>,
}

impl Harness {
    /// With all signals.
    pub fn new(robot: &Robot, setup: &Setup) -> Self {
        Self::with_outputs(robot, setup, &|_| true)
    }

    /// With the requested signals.
    pub fn with_outputs(robot: &Robot, setup: &Setup, requested: &dyn Fn(&str) -> bool) -> Self {
        Self::build(robot, setup, Force::Solve, requested)
    }

    /// With all signals and the given method for the force of a leg.
    pub fn with_force(robot: &Robot, setup: &Setup, force: Force) -> Self {
        Self::build(robot, setup, force, &|_| true)
    }

    /// The initial commands hold the drives at their start.
    fn build(robot: &Robot, setup: &Setup, force: Force, requested: &dyn Fn(&str) -> bool) -> Self {
        let setup = setup.clone();
        let plant = Massless::new(robot, &Options { setup, force }, requested).unwrap();
        let layout = |direction| Layout::of(&plant.ports(), direction);
        let mut commands = vec![0.0; layout(Direction::Input).len()];
        plant.initial_inputs(&mut commands);
        let layout = layout(Direction::Output);
        let outputs = vec![0.0; layout.len()];
        Self {
            plant,
            commands,
            layout,
            outputs,
        }
    }

    /// A harness in the middle of a trot.
    pub fn trotting(robot: &Robot, setup: &Setup, force: Force, since_ms: u64) -> Self {
        let mut setup = setup.clone();
        setup.start = Trot::START.commands(robot, &setup, 0.0).into();
        let mut harness = Self::with_force(robot, &setup, force);
        for ms in 1..=since_ms {
            harness.trot(robot, &setup, Trot::START, ms);
        }
        harness
    }

    /// Advances to `ms` under the commands of a trot.
    pub fn trot(&mut self, robot: &Robot, setup: &Setup, trot: Trot, ms: u64) {
        let commands = trot.commands(robot, setup, ms as f64 * 1e-3);
        for (pair, (_, command)) in self.commands.chunks_mut(2).zip(commands) {
            pair.copy_from_slice(&[command.hip, command.knee]);
        }
        self.advance_to(ms);
    }

    /// Advances to `ms` milliseconds with the present commands.
    pub fn advance_to(&mut self, ms: u64) {
        self.try_advance_to(ms).unwrap();
    }

    /// Advances to `ms` milliseconds with the present commands.
    pub fn try_advance_to(&mut self, ms: u64) -> Result<(), PlantFault> {
        self.plant.advance(at(ms), &self.commands)
    }

    /// Returns all signals.
    pub fn observe(&mut self) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        &self.outputs
    }

    /// Returns the present value of a signal.
    pub fn read(&mut self, signal: &str) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        let range = self.layout.find(signal).unwrap();
        &self.outputs[range]
    }

    /// Returns the present value of a scalar signal.
    pub fn value(&mut self, signal: &str) -> f64 {
        let values = self.read(signal);
        assert_eq!(values.len(), 1, "{signal}");
        values[0]
    }

    pub fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }
}

/// Instant of a time in milliseconds.
pub fn at(ms: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(ms)
}

/// Name and mechanism of the legs that are present, in the robot's order.
pub fn legs_of<'a>(
    robot: &'a Robot,
    setup: &'a Setup,
) -> impl Iterator<Item = (String, Pantograph)> + 'a {
    robot
        .legs
        .iter()
        .filter(|mount| setup.legs.contains(&mount.name))
        .map(|mount| (mount.name.clone(), Pantograph::new(&mount.leg).unwrap()))
}

/// A trot in the air: feet on ellipses, diagonal pairs half a cycle apart, without regard to duty
/// factor or springs.
#[derive(Clone, Copy, Debug)]
pub struct Trot {
    /// Frequency of the cycle \[Hz\].
    pub frequency: f64,
    /// Half of the stroke, relative to the greatest leg length.
    pub stroke: f64,
    /// Lift of the feet, relative to the greatest leg length.
    pub lift: f64,
    /// Length of the leg in stance, relative to the greatest.
    pub length: f64,
}

impl Trot {
    /// A trot at which the robot does not fall over.
    pub const START: Self = Self {
        frequency: 2.0,
        stroke: 0.15,
        lift: 0.1,
        length: 0.9,
    };

    /// Commands of the drives of each leg at a time.
    pub fn commands(self, robot: &Robot, setup: &Setup, time_s: f64) -> Vec<(String, LegCommand)> {
        legs_of(robot, setup)
            .map(|(name, leg)| {
                let offset = if matches!(name.as_str(), "LF" | "RH") {
                    0.0
                } else {
                    0.5
                };
                let angle = std::f64::consts::TAU * (self.frequency * time_s + offset);
                let length = leg.length_max();
                let foot = Planar::new(
                    self.stroke * length * libm::cos(angle),
                    length * (self.lift * libm::sin(angle).max(0.0) - self.length),
                );
                (name, leg.inverse_closed(foot).unwrap())
            })
            .collect()
    }
}
