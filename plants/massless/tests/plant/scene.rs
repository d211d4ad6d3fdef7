//! The robot in motion: what the tests and the benchmark drive.

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
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    RobotFile::find(name, beside).unwrap().robot().unwrap()
}

/// A servo that a trot needs.
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

/// The same on a plane that falls towards +x by `slope` metres a metre, the trunk level and all feet on it.
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

/// A plant with what is needed to drive and read it.
#[derive(Clone, Debug)]
pub struct Scene {
    pub plant: Massless,
    pub commands: Vec<f64>,
    layout: Layout,
    outputs: Vec<f64>,
}

impl Scene {
    /// With every signal.
    pub fn new(robot: &Robot, setup: &Setup) -> Self {
        Self::wanting(robot, setup, &|_| true)
    }

    /// With the signals that are wanted.
    pub fn wanting(robot: &Robot, setup: &Setup, wanted: &dyn Fn(&str) -> bool) -> Self {
        Self::built(robot, setup, Force::Solve, wanted)
    }

    /// With its forces from here or there.
    pub fn forced(robot: &Robot, setup: &Setup, force: Force) -> Self {
        Self::built(robot, setup, force, &|_| true)
    }

    /// The commands keep the drives where they start.
    fn built(robot: &Robot, setup: &Setup, force: Force, wanted: &dyn Fn(&str) -> bool) -> Self {
        let setup = setup.clone();
        let plant = Massless::new(robot, &Options { setup, force }, wanted).unwrap();
        let layout = |direction| Layout::of(&plant.ports(), direction);
        let mut commands = vec![0.0; layout(Direction::Input).len()];
        plant.first_inputs(&mut commands);
        let layout = layout(Direction::Output);
        let outputs = vec![0.0; layout.len()];
        Self {
            plant,
            commands,
            layout,
            outputs,
        }
    }

    /// A scene in mid-trot.
    pub fn trotting(robot: &Robot, setup: &Setup, force: Force, since_ms: u64) -> Self {
        let mut setup = setup.clone();
        setup.start = Trot::START.commands(robot, &setup, 0.0).into();
        let mut scene = Self::forced(robot, &setup, force);
        for ms in 1..=since_ms {
            scene.trot(robot, &setup, Trot::START, ms);
        }
        scene
    }

    /// Advances to `ms` under the commands of a trot.
    pub fn trot(&mut self, robot: &Robot, setup: &Setup, trot: Trot, ms: u64) {
        let commands = trot.commands(robot, setup, ms as f64 * 1e-3);
        for (pair, (_, command)) in self.commands.chunks_mut(2).zip(commands) {
            pair.copy_from_slice(&[command.hip, command.knee]);
        }
        self.to(ms);
    }

    /// Advances to `ms` milliseconds with the present commands.
    pub fn to(&mut self, ms: u64) {
        self.try_to(ms).unwrap();
    }

    /// Advances to `ms` milliseconds with the present commands.
    pub fn try_to(&mut self, ms: u64) -> Result<(), PlantFault> {
        self.plant.advance(at(ms), &self.commands)
    }

    /// Looks at everything.
    pub fn observe(&mut self) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        &self.outputs
    }

    /// A signal now.
    pub fn read(&mut self, signal: &str) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        let range = self.layout.find(signal).unwrap();
        &self.outputs[range]
    }

    /// A signal with one number now.
    pub fn value(&mut self, signal: &str) -> f64 {
        let values = self.read(signal);
        assert_eq!(values.len(), 1, "{signal}");
        values[0]
    }

    pub fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }
}

/// An instant.
pub fn at(ms: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(ms)
}

/// Name and mechanism of the legs that are there, in the robot's order.
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

/// A trot in the air: feet on ellipses, diagonal pairs half a cycle apart. It knows nothing of phases, duty or springs.
#[derive(Clone, Copy, Debug)]
pub struct Trot {
    /// Cycles a second.
    pub frequency: f64,
    /// Half of the stroke, as a share of the greatest leg length.
    pub stroke: f64,
    /// How far the feet are lifted, as a share of the greatest leg length.
    pub lift: f64,
    /// Length of the leg in stance, as a share of the greatest.
    pub length: f64,
}

impl Trot {
    /// One that the robot does not fall over at.
    pub const START: Self = Self {
        frequency: 2.0,
        stroke: 0.15,
        lift: 0.1,
        length: 0.9,
    };

    /// What the drives of each leg are told at a time.
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
