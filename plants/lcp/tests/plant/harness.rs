//! Robots, setups, integration options and plants of the tests.

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_lcp::{Lcp, LcpError, Method, Options};
use twinrig_legged::{Setup, Start};
use twinrig_robot::Robot;
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::robots::{self, LEGS, SERVOS, pose, robot, with_legs};

/// Plant with its commands and signals.
pub type Harness = PlantHarness<Lcp>;

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

/// Returns flat ground `height` below the starting feet.
pub fn lowered_ground(height: f64, friction: f64) -> Ground {
    let terrain = Terrain::step_down(-10.0, height);
    Ground::new(terrain, friction, 0.0).unwrap()
}

/// Returns a setup of legs suspended from a fixed trunk, without drives.
pub fn suspended(start: Start) -> Setup {
    robots::suspended(&LEGS, start, 2000)
}

/// Returns a setup of the free robot on flat ground, with servos.
pub fn standing_setup() -> Setup {
    robots::standing(SERVOS, 2000)
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
        constraints: twinrig_lcp::Constraints::Rigid,
        setup: Setup {
            step: SimDuration::from_micros(integration.step_us),
            ..setup.clone()
        },
        method: integration.method,
        tolerance: integration.tolerance,
        toe: integration.toe,
        features: twinrig_lcp::Features::Detected,
    };
    Lcp::new(robot, &options, selected)
}

/// Creates a harness of the plant with all signals.
pub fn lcp(robot: &Robot, setup: &Setup, integration: Integration) -> Harness {
    lcp_with_signals(robot, setup, integration, &|_| true)
}

/// Creates a harness of the plant with the selected signals.
pub fn lcp_with_signals(
    robot: &Robot,
    setup: &Setup,
    integration: Integration,
    selected: &dyn Fn(&str) -> bool,
) -> Harness {
    let mut harness = Harness::new(with_signals(robot, setup, integration, selected).unwrap());
    harness.step_us = integration.step_us;
    harness
}

/// Returns the root mean square distance of two traces.
pub fn rmse(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square =
        |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>();
    let squares = a.iter().zip(b).map(|(a, b)| square(a, b));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}
