//! Setups and plants of the tests.

use twinrig_contact::{Ground, HeightField, Terrain};
use twinrig_legged::Setup;
use twinrig_massless::{Force, Massless, Options};
use twinrig_robot::Robot;
use twinrig_robot::leg::{Pantograph, Planar};
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::robots::{SERVOS, standing};
use twinrig_testing::trot::Trot;

/// Plant with its commands and signals.
pub type Harness = PlantHarness<Massless>;

/// All four legs, free, on flat ground, in steps of a millisecond.
pub fn setup() -> Setup {
    standing(SERVOS, 1000)
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

/// Creates a harness of the plant with all signals.
pub fn massless(robot: &Robot, setup: &Setup) -> Harness {
    build(robot, setup, Force::Solve, &|_| true)
}

/// Creates a harness of the plant with the requested signals.
pub fn with_outputs(robot: &Robot, setup: &Setup, requested: &dyn Fn(&str) -> bool) -> Harness {
    build(robot, setup, Force::Solve, requested)
}

/// Creates a harness of the plant with all signals and a method for the force of a leg.
pub fn with_force(robot: &Robot, setup: &Setup, force: Force) -> Harness {
    build(robot, setup, force, &|_| true)
}

fn build(robot: &Robot, setup: &Setup, force: Force, requested: &dyn Fn(&str) -> bool) -> Harness {
    let setup = setup.clone();
    Harness::new(Massless::new(robot, &Options::new(setup, force), requested).unwrap())
}

/// Creates a harness in the middle of a trot.
pub fn trotting(robot: &Robot, setup: &Setup, force: Force, since_ms: u64) -> Harness {
    let setup = Trot::START.started(robot, setup.clone());
    let mut harness = with_force(robot, &setup, force);
    for ms in 1..=since_ms {
        harness.trot(robot, &setup, Trot::START, ms);
    }
    harness
}
