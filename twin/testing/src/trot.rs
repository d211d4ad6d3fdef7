//! Trot as a test input.

use twinrig_legged::Setup;
use twinrig_robot::Robot;
use twinrig_robot::leg::{LegCommand, Pantograph, Planar};

/// A trot in the air: feet on half ellipses, diagonal pairs half a cycle apart, without regard to
/// duty factor or springs.
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

    /// Returns the commands of the drives of each leg at a time.
    pub fn legs(self, robot: &Robot, setup: &Setup, time_s: f64) -> Vec<(String, LegCommand)> {
        let mounts = setup.selected_mounts(robot).unwrap().into_iter();
        let commands = mounts.map(|mount| {
            let offset = if matches!(mount.name.as_str(), "LF" | "RH") {
                0.0
            } else {
                0.5
            };
            let angle = std::f64::consts::TAU * (self.frequency * time_s + offset);
            let leg = Pantograph::new(&mount.leg).unwrap();
            let lift = self.lift * libm::sin(angle).max(0.0);
            let share = Planar::new(self.stroke * libm::cos(angle), lift - self.length);
            let foot = share * leg.length_max();
            (mount.name.clone(), leg.inverse_closed(foot).unwrap())
        });
        commands.collect()
    }

    /// Returns the inputs of a plant at a time.
    pub fn commands(self, robot: &Robot, setup: &Setup, time_s: f64) -> Vec<f64> {
        let legs = self.legs(robot, setup, time_s);
        let pairs = legs.iter().map(|(_, command)| [command.hip, command.knee]);
        pairs.flatten().collect()
    }

    /// Returns the inputs of a plant every 2 ms over an interval.
    pub fn sampled(self, robot: &Robot, setup: &Setup, from_ms: u32, to_ms: u32) -> Vec<Vec<f64>> {
        let ticks = from_ms / 2 + 1..=to_ms / 2;
        let commands = ticks.map(|tick| self.commands(robot, setup, f64::from(tick) * 2e-3));
        commands.collect()
    }

    /// Returns the setup with the initial pose of the trot.
    pub fn started(self, robot: &Robot, mut setup: Setup) -> Setup {
        setup.start = self.legs(robot, &setup, 0.0).into();
        setup
    }
}
