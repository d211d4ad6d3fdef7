//! A trot by the book, for what has to be driven: diagonal legs take turns, feet go round on half ellipses.

use twinrig_leg::{LegCommand, Pantograph, Planar};
use twinrig_legged::Setup;
use twinrig_robot::Robot;

/// Cycles a second.
const FREQUENCY: f64 = 2.0;

/// Half the stroke, lift of the feet, and length of the leg in stance, as shares of the greatest leg length.
const STROKE: f64 = 0.15;
const LIFT: f64 = 0.1;
const LENGTH: f64 = 0.9;

/// What the drives of each leg are told at a time.
fn legs(robot: &Robot, setup: &Setup, seconds: f64) -> Vec<(String, LegCommand)> {
    let mounts = setup.chosen(robot).unwrap().into_iter();
    let told = mounts.map(|mount| {
        let late = if matches!(mount.name.as_str(), "LF" | "RH") {
            0.0
        } else {
            0.5
        };
        let angle = std::f64::consts::TAU * (FREQUENCY * seconds + late);
        let leg = Pantograph::new(&mount.leg).unwrap();
        let lift = LIFT * libm::sin(angle).max(0.0);
        let share = Planar::new(STROKE * libm::cos(angle), lift - LENGTH);
        let foot = share * leg.length_max();
        (mount.name.clone(), leg.inverse_closed(foot).unwrap())
    });
    told.collect()
}

/// The same setup, started as the trot starts.
pub fn begun(robot: &Robot, mut setup: Setup) -> Setup {
    setup.start = legs(robot, &setup, 0.0).into();
    setup
}

/// Commands every two milliseconds, from one instant to another.
pub fn commands(robot: &Robot, setup: &Setup, from_ms: u32, to_ms: u32) -> Vec<Vec<f64>> {
    let ticks = from_ms / 2 + 1..=to_ms / 2;
    let told = ticks.map(|tick| {
        let legs = legs(robot, setup, f64::from(tick) * 2e-3);
        let pairs = legs.iter().map(|(_, told)| [told.hip, told.knee]);
        pairs.flatten().collect()
    });
    told.collect()
}
