//! Plants of the tests.

use twinrig_legged::{Drives, Setup};
use twinrig_rapier::{Joints, Options, Rapier};
use twinrig_robot::Robot;
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::robots;

pub type Fixture = PlantHarness<Rapier>;

/// Creates the robot with these options.
pub fn with_options(robot: &Robot, options: &Options) -> Fixture {
    Fixture::new(Rapier::new(robot, options, &|_| true).unwrap())
}

/// Creates the robot with the default options of these joints.
pub fn with_joints(robot: &Robot, setup: Setup, joints: Joints) -> Fixture {
    with_options(robot, &Options::new(setup, joints))
}

/// Returns the setup of the robot on flat ground with ideal drives.
pub fn standing(step_us: u64) -> Setup {
    robots::standing(Drives::Ideal { period: 2e-3 }, step_us)
}
