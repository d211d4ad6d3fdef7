//! The robot in motion: what the tests drive and read.

use std::path::Path;

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Lcp, LcpError, Method, Options};
use twinrig_legged::{Base, Drives, Setup, Start, StartPose};
use twinrig_robot::{Robot, RobotFile, Servo};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault};

/// The robot of `robots/cheetah-cub.toml`.
pub fn robot() -> Robot {
    let beside = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let file = RobotFile::find("cheetah-cub", beside).unwrap();
    file.robot().unwrap()
}

/// The same with springs so many times as stiff, which push as hard at the stops as before.
pub fn stiffened(times: f64) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        for spring in [&mut mount.leg.diagonal, &mut mount.leg.parallel] {
            spring.stiffness *= times;
            spring.preload /= times;
        }
    }
    robot
}

/// The same with another of each leg.
pub fn changed(change: impl Fn(&mut twinrig_robot::Leg)) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        change(&mut mount.leg);
    }
    robot
}

/// A servo that a trot needs.
pub const SERVO: Servo = Servo {
    torque: 4.0,
    speed: 25.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-3,
};

pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Angles in degrees, rates in rad/s.
pub fn pose(q: [f64; 3], rates: [f64; 3]) -> Start {
    let q = q.map(f64::to_radians);
    StartPose { q, rates }.into()
}

/// The thesis' passive legs: at rest on their lower stop.
pub fn passive() -> Start {
    pose([10.0, -9.5, 9.5], [0.0; 3])
}

/// A start that hits the stops hard.
pub fn hard() -> Start {
    pose([20.0, -40.0, 62.0], [-10.0, 15.0, 30.0])
}

/// A start between the stops of [`between`].
pub fn swinging() -> Start {
    pose([10.0, -25.0, 37.0], [6.0, -4.0, 3.0])
}

/// The robot with springs that let its legs swing between their stops and never reach them.
pub fn between() -> Robot {
    changed(|leg| {
        leg.diagonal.preload = -0.004;
        leg.parallel.preload = -0.004;
        leg.parallel_travel = 0.014;
    })
}

pub fn flat(friction: f64) -> Ground {
    Ground::new(Terrain::Flat, friction, 0.0).unwrap()
}

/// A ground that is lower than the feet start.
pub fn below(height: f64, friction: f64) -> Ground {
    let terrain = Terrain::StepDown {
        at: -10.0,
        drop: height,
    };
    Ground::new(terrain, friction, 0.0).unwrap()
}

/// Legs that hang from a trunk that is held, without drives.
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

/// All of the robot, free, on flat ground, driven.
pub fn standing() -> Setup {
    Setup {
        base: Base::Free,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: Some(flat(0.6)),
        step: SimDuration::from_millis(2),
        drives: Drives::Servos {
            hip: SERVO,
            knee: SERVO,
        },
        start: Start::default(),
    }
}

/// How time is integrated.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub method: Method,
    pub step_us: u64,
    pub tolerance: f64,
    /// Whether legs have a joint in the toe.
    pub toe: bool,
}

/// As scenarios have it that do not say.
pub const DEFAULT: Way = Way {
    method: Method::Rk4,
    step_us: 2000,
    tolerance: Options::TOLERANCE,
    toe: false,
};

impl Way {
    pub const fn by(method: Method, step_us: u64) -> Self {
        Self {
            method,
            step_us,
            tolerance: Options::TOLERANCE,
            toe: false,
        }
    }

    pub const fn with_toes(self) -> Self {
        Self { toe: true, ..self }
    }

    pub const fn within(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }
}

/// Every method at a step that it is good for; the thesis' is the last.
pub const WAYS: [Way; 6] = [
    DEFAULT,
    Way::by(Method::Rodas4, 2000),
    Way::by(Method::Moreau, 2000),
    Way::by(Method::SemiImplicit, 1000),
    Way::by(Method::ExplicitEuler, 50),
    Way::by(Method::Thesis, 50),
];

/// The plant, or why there is none.
pub fn built(robot: &Robot, setup: &Setup, way: Way) -> Result<Lcp, LcpError> {
    wanting(robot, setup, way, &|_| true)
}

fn wanting(
    robot: &Robot,
    setup: &Setup,
    way: Way,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Lcp, LcpError> {
    let options = Options {
        setup: Setup {
            step: SimDuration::from_micros(way.step_us),
            ..setup.clone()
        },
        method: way.method,
        tolerance: way.tolerance,
        toe: way.toe,
    };
    Lcp::new(robot, &options, wanted)
}

/// A plant with what is needed to drive and read it.
pub struct Scene {
    pub plant: Lcp,
    pub commands: Vec<f64>,
    layout: Layout,
    outputs: Vec<f64>,
    step_us: u64,
    pub now_us: u64,
}

impl Scene {
    pub fn new(robot: &Robot, setup: &Setup, way: Way) -> Self {
        Self::wanting(robot, setup, way, &|_| true)
    }

    /// With the signals that are wanted.
    pub fn wanting(robot: &Robot, setup: &Setup, way: Way, wanted: &dyn Fn(&str) -> bool) -> Self {
        let plant = wanting(robot, setup, way, wanted).unwrap();
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
            step_us: way.step_us,
            now_us: 0,
        }
    }

    /// Advances to an instant, by whole steps and what is left.
    pub fn try_to_us(&mut self, us: u64) -> Result<(), PlantFault> {
        self.plant
            .advance(SimTime::ZERO + SimDuration::from_micros(us), &self.commands)?;
        self.now_us = us;
        Ok(())
    }

    #[expect(clippy::wrong_self_convention, reason = "it goes there")]
    pub fn to_ms(&mut self, ms: u64) {
        self.try_to_us(1000 * ms).unwrap();
    }

    /// One step.
    pub fn step(&mut self) -> Result<(), PlantFault> {
        self.try_to_us(self.now_us + self.step_us)
    }

    /// Steps for so long, and looks at every number on the way; what stopped it before.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "scenes last seconds"
    )]
    pub fn soundly(&mut self, seconds: f64) -> Result<(), PlantFault> {
        let until = self.now_us + (seconds * 1e6).round() as u64;
        while self.now_us < until {
            let before = self.observe().to_vec();
            let moved = self.step();
            let now = self.now_us;
            let after = self.observe();
            assert!(after.iter().all(|x| !x.is_nan()), "at {now} µs");
            if let Err(fault) = moved {
                assert_eq!(after, before, "it stays where it last was");
                assert_eq!(fault.time.as_nanos(), 1000 * now);
                assert!(!fault.part.is_empty() && !fault.why.is_empty());
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Every signal now.
    pub fn observe(&mut self) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        &self.outputs
    }

    /// A signal now.
    pub fn read(&mut self, signal: &str) -> Vec<f64> {
        self.plant.observe(&mut self.outputs);
        self.outputs[self.layout.find(signal).unwrap()].to_vec()
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

    /// Places of a foot every 2 ms for so many milliseconds.
    pub fn trace(&mut self, leg: &str, ms: u64) -> Vec<[f64; 3]> {
        let signal = format!("leg/{leg}/foot/position");
        (1..=ms / 2)
            .map(|k| {
                self.to_ms(2 * k);
                self.read(&signal).try_into().unwrap()
            })
            .collect()
    }
}

/// Root mean square distance of two traces.
pub fn rmse(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square =
        |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>();
    let squares = a.iter().zip(b).map(|(a, b)| square(a, b));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}
