//! Plants of the tests.

use twinrig_legged::{Drives, Setup, Start};
use twinrig_mujoco::{Coordinates, Mujoco, Options};
use twinrig_robot::{Robot, Servo};
use twinrig_testing::plant_harness::PlantHarness;
use twinrig_testing::robots::{self, LEGS, robot, suspended};

/// A servo sufficient for a trot.
pub const SERVO: Servo = Servo {
    torque: 5.0,
    speed: 20.0,
    lag: 5e-3,
    dead_band: 0.0,
    inertia: 1e-4,
};

pub type Fixture = PlantHarness<Mujoco>;

/// Creates a robot with these options.
pub fn with_options(robot: &Robot, options: &Options) -> Fixture {
    Fixture::new(Mujoco::new(robot, options, &|_| true).unwrap())
}

/// Creates the robot with the default options of these coordinates.
pub fn with_coordinates(setup: Setup, coordinates: Coordinates) -> Fixture {
    with_options(&robot(), &Options::new(setup, coordinates))
}

/// Returns the setup of legs that hang from a fixed trunk, without drives.
pub fn hanging(start: Start) -> Setup {
    suspended(&LEGS, start, 2000)
}

/// Returns the setup of the free robot on flat ground, with servos.
pub fn standing() -> Setup {
    let drives = Drives::Servos {
        hip: SERVO,
        knee: SERVO,
    };
    robots::standing(drives, 2000)
}
