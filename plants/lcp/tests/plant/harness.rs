//! Test harness: robots, setups, integration options, and a plant with its inputs and outputs.

use std::path::Path;

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_lcp::{Lcp, LcpError, Method, Options};
use twinrig_legged::{Base, Drives, Setup, Start, StartPose};
use twinrig_robot::{Robot, RobotFile, Servo};
use twinrig_runtime::{EnergyBalance, Plant, PlantFault};

/// Returns the robot of `robots/cheetah-cub.toml`.
pub fn robot() -> Robot {
    let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let file = RobotFile::find("cheetah-cub", workspace).unwrap();
    file.robot().unwrap()
}

/// Returns the robot with springs of `times` the stiffness, with unchanged forces at the stops.
pub fn with_stiffness(times: f64) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        for spring in [&mut mount.leg.diagonal, &mut mount.leg.parallel] {
            spring.stiffness *= times;
            spring.preload /= times;
        }
    }
    robot
}

/// Returns the robot with modified legs.
pub fn with_legs(change: impl Fn(&mut twinrig_robot::Leg)) -> Robot {
    let mut robot = robot();
    for mount in &mut robot.legs {
        change(&mut mount.leg);
    }
    robot
}

/// Servo parameters sufficient for a trot.
pub const SERVO: Servo = Servo {
    torque: 4.0,
    speed: 25.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-3,
};

pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Returns a start at joint angles in degrees and rates in rad/s.
pub fn pose(q: [f64; 3], rates: [f64; 3]) -> Start {
    let q = q.map(f64::to_radians);
    StartPose { q, rates }.into()
}

/// Returns the start of the passive legs of the thesis: at rest on their lower stop.
pub fn passive_start() -> Start {
    pose([10.0, -9.5, 9.5], [0.0; 3])
}

/// Returns a start with hard impacts on the stops.
pub fn hard_impact() -> Start {
    pose([20.0, -40.0, 62.0], [-10.0, 15.0, 30.0])
}

/// Returns a start within the stops of [`free_swinging_robot`].
pub fn swinging_start() -> Start {
    pose([10.0, -25.0, 37.0], [6.0, -4.0, 3.0])
}

/// Returns the robot with springs that keep its swinging legs off their stops.
pub fn free_swinging_robot() -> Robot {
    with_legs(|leg| {
        leg.diagonal.preload = -0.004;
        leg.parallel.preload = -0.004;
        leg.parallel_travel = 0.014;
    })
}

pub fn flat(friction: f64) -> Ground {
    Ground::new(Terrain::Flat, friction, 0.0).unwrap()
}

/// Returns flat ground `height` below the starting feet.
pub fn lowered_ground(height: f64, friction: f64) -> Ground {
    let terrain = Terrain::StepDown {
        at: -10.0,
        drop: height,
    };
    Ground::new(terrain, friction, 0.0).unwrap()
}

/// Returns a setup of legs suspended from a fixed trunk, without drives.
pub fn suspended(start: Start) -> Setup {
    Setup {
        base: Base::Fixed,
        legs: LEGS.map(str::to_owned).to_vec(),
        ground: None,
        step: SimDuration::from_millis(2),
        drives: Drives::None,
        start,
    }
}

/// Returns a setup of the free robot on flat ground, with servos.
pub fn standing_setup() -> Setup {
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

/// Integration options.
#[derive(Clone, Copy, Debug)]
pub struct Integration {
    pub method: Method,
    pub step_us: u64,
    pub tolerance: f64,
    /// Whether legs have a toe joint.
    pub toe: bool,
}

/// Defaults of scenarios.
pub const DEFAULT: Integration = Integration {
    method: Method::Rk4,
    step_us: 2000,
    tolerance: Options::TOLERANCE,
    toe: false,
};

impl Integration {
    pub const fn new(method: Method, step_us: u64) -> Self {
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

    pub const fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }
}

/// Every method at a suitable step; the last is that of the thesis.
pub const INTEGRATIONS: [Integration; 6] = [
    DEFAULT,
    Integration::new(Method::Rodas4, 2000),
    Integration::new(Method::Moreau, 2000),
    Integration::new(Method::SemiImplicit, 1000),
    Integration::new(Method::ExplicitEuler, 50),
    Integration::new(Method::Thesis, 50),
];

/// Builds the plant with all signals.
pub fn build(robot: &Robot, setup: &Setup, integration: Integration) -> Result<Lcp, LcpError> {
    with_signals(robot, setup, integration, &|_| true)
}

fn with_signals(
    robot: &Robot,
    setup: &Setup,
    integration: Integration,
    selected: &dyn Fn(&str) -> bool,
) -> Result<Lcp, LcpError> {
    let options = Options {
        setup: Setup {
            step: SimDuration::from_micros(integration.step_us),
            ..setup.clone()
        },
        method: integration.method,
        tolerance: integration.tolerance,
        toe: integration.toe,
    };
    Lcp::new(robot, &options, selected)
}

/// Plant with its inputs and outputs.
pub struct Harness {
    pub plant: Lcp,
    pub commands: Vec<f64>,
    layout: Layout,
    outputs: Vec<f64>,
    step_us: u64,
    pub now_us: u64,
}

impl Harness {
    pub fn new(robot: &Robot, setup: &Setup, integration: Integration) -> Self {
        Self::with_signals(robot, setup, integration, &|_| true)
    }

    /// Creates a harness whose plant has the selected signals.
    pub fn with_signals(
        robot: &Robot,
        setup: &Setup,
        integration: Integration,
        selected: &dyn Fn(&str) -> bool,
    ) -> Self {
        let plant = with_signals(robot, setup, integration, selected).unwrap();
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
            step_us: integration.step_us,
            now_us: 0,
        }
    }

    /// Advances to an instant, by whole steps and a remainder.
    pub fn try_advance_to_us(&mut self, us: u64) -> Result<(), PlantFault> {
        self.plant
            .advance(SimTime::ZERO + SimDuration::from_micros(us), &self.commands)?;
        self.now_us = us;
        Ok(())
    }

    pub fn advance_to_ms(&mut self, ms: u64) {
        self.try_advance_to_us(1000 * ms).unwrap();
    }

    /// Advances by one step.
    pub fn step(&mut self) -> Result<(), PlantFault> {
        self.try_advance_to_us(self.now_us + self.step_us)
    }

    /// Runs for a duration and checks every output for NaN after each step. Returns the fault of a
    /// failed step, after checking that the outputs are unchanged.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "runs last seconds"
    )]
    pub fn run_checked(&mut self, seconds: f64) -> Result<(), PlantFault> {
        let until = self.now_us + (seconds * 1e6).round() as u64;
        while self.now_us < until {
            let before = self.observe().to_vec();
            let result = self.step();
            let now = self.now_us;
            let after = self.observe();
            assert!(after.iter().all(|x| !x.is_nan()), "at {now} µs");
            if let Err(fault) = result {
                assert_eq!(after, before, "outputs are unchanged after a fault");
                assert_eq!(fault.time.as_nanos(), 1000 * now);
                assert!(!fault.part.is_empty() && !fault.why.is_empty());
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Returns all signals.
    pub fn observe(&mut self) -> &[f64] {
        self.plant.observe(&mut self.outputs);
        &self.outputs
    }

    /// Returns a signal.
    pub fn read(&mut self, signal: &str) -> Vec<f64> {
        self.plant.observe(&mut self.outputs);
        self.outputs[self.layout.find(signal).unwrap()].to_vec()
    }

    /// Returns a scalar signal.
    pub fn value(&mut self, signal: &str) -> f64 {
        let values = self.read(signal);
        assert_eq!(values.len(), 1, "{signal}");
        values[0]
    }

    pub fn energy(&self) -> EnergyBalance {
        self.plant.energy()
    }

    /// Returns the positions of a foot every 2 ms for a duration in milliseconds.
    pub fn trace(&mut self, leg: &str, ms: u64) -> Vec<[f64; 3]> {
        let signal = format!("leg/{leg}/foot/position");
        (1..=ms / 2)
            .map(|k| {
                self.advance_to_ms(2 * k);
                self.read(&signal).try_into().unwrap()
            })
            .collect()
    }
}

/// Returns the root mean square distance of two traces.
pub fn rmse(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square =
        |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>();
    let squares = a.iter().zip(b).map(|(a, b)| square(a, b));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}
