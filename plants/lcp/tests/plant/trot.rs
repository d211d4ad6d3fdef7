//! Trot as a test input: diagonal legs alternate, feet move on half ellipses.

use twinrig_leg::{LegCommand, Pantograph, Planar};
use twinrig_legged::Setup;
use twinrig_robot::Robot;

/// Stride frequency \[Hz\].
const FREQUENCY: f64 = 2.0;

/// Half the stroke, foot lift, and leg length in stance, relative to the greatest leg length.
const STROKE: f64 = 0.15;
const LIFT: f64 = 0.1;
const LENGTH: f64 = 0.9;

/// Returns the commands of the legs at a time.
fn legs(robot: &Robot, setup: &Setup, seconds: f64) -> Vec<(String, LegCommand)> {
    let mounts = setup.selected_mounts(robot).unwrap().into_iter();
    let commands = mounts.map(|mount| {
        let offset = if matches!(mount.name.as_str(), "LF" | "RH") {
            0.0
        } else {
            0.5
        };
        let angle = std::f64::consts::TAU * (FREQUENCY * seconds + offset);
        let leg = Pantograph::new(&mount.leg).unwrap();
        let lift = LIFT * libm::sin(angle).max(0.0);
        let share = Planar::new(STROKE * libm::cos(angle), lift - LENGTH);
        let foot = share * leg.length_max();
        (mount.name.clone(), leg.inverse_closed(foot).unwrap())
    });
    commands.collect()
}

/// Returns the setup with the initial pose of the trot.
pub fn start_of_trot(robot: &Robot, mut setup: Setup) -> Setup {
    setup.start = legs(robot, &setup, 0.0).into();
    setup
}

/// Returns commands every 2 ms over an interval.
pub fn commands(robot: &Robot, setup: &Setup, from_ms: u32, advance_to_ms: u32) -> Vec<Vec<f64>> {
    let ticks = from_ms / 2 + 1..=advance_to_ms / 2;
    let commands = ticks.map(|tick| {
        let legs = legs(robot, setup, f64::from(tick) * 2e-3);
        let pairs = legs.iter().map(|(_, command)| [command.hip, command.knee]);
        pairs.flatten().collect()
    });
    commands.collect()
}
