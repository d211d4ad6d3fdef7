//! State: positions and velocities of trunk, feet and drives.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use twinrig_legged::LEGS;
use twinrig_robot::leg::Planar;

/// Components of the trunk: position, attitude, velocity, angular velocity.
const TRUNK: usize = 13;

/// Components of a leg: foot (hip frame), hip, pulley; foot velocity (absolute), hip rate, pulley
/// rate.
const LEG: usize = 8;

/// Position of the trunk's centre of mass, world frame.
const POSITION: usize = 0;
/// Attitude of the trunk as a quaternion w, x, y, z from trunk to world.
const ATTITUDE: usize = 3;
/// Velocity of the centre of mass, trunk frame.
const VELOCITY: usize = 7;
/// Angular velocity, trunk frame.
const RATE: usize = 10;

/// Offsets within a leg.
const FOOT: usize = 0;
const HIP: usize = 2;
const PULLEY: usize = 3;
const FOOT_VELOCITY: usize = 4;
const HIP_RATE: usize = 6;
const PULLEY_RATE: usize = 7;

/// State of trunk and legs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub(crate) struct State {
    numbers: [f64; TRUNK + LEGS * LEG],
}

macro_rules! scalar {
    ($(#[$doc:meta])* $get:ident, $set:ident, $offset:ident) => {
        $(#[$doc])*
        pub(crate) fn $get(&self, leg: usize) -> f64 {
            self.numbers[TRUNK + leg * LEG + $offset]
        }

        pub(crate) fn $set(&mut self, leg: usize, value: f64) {
            self.numbers[TRUNK + leg * LEG + $offset] = value;
        }
    };
}

impl State {
    pub(crate) const fn zero() -> Self {
        Self {
            numbers: [0.0; TRUNK + LEGS * LEG],
        }
    }

    fn vector(&self, at: usize) -> Vector3<f64> {
        Vector3::new(self.numbers[at], self.numbers[at + 1], self.numbers[at + 2])
    }

    fn put(&mut self, at: usize, value: Vector3<f64>) {
        self.numbers[at..at + 3].copy_from_slice(value.as_slice());
    }

    pub(crate) fn position(&self) -> Vector3<f64> {
        self.vector(POSITION)
    }

    pub(crate) fn set_position(&mut self, value: Vector3<f64>) {
        self.put(POSITION, value);
    }

    pub(crate) fn attitude(&self) -> [f64; 4] {
        [
            self.numbers[3],
            self.numbers[4],
            self.numbers[5],
            self.numbers[6],
        ]
    }

    pub(crate) fn set_attitude(&mut self, value: [f64; 4]) {
        self.numbers[ATTITUDE..ATTITUDE + 4].copy_from_slice(&value);
    }

    /// Velocity of the centre of mass in the trunk frame.
    pub(crate) fn velocity(&self) -> Vector3<f64> {
        self.vector(VELOCITY)
    }

    pub(crate) fn set_velocity(&mut self, value: Vector3<f64>) {
        self.put(VELOCITY, value);
    }

    /// Angular velocity in the trunk frame.
    pub(crate) fn rate(&self) -> Vector3<f64> {
        self.vector(RATE)
    }

    pub(crate) fn set_rate(&mut self, value: Vector3<f64>) {
        self.put(RATE, value);
    }

    /// Foot in the leg plane, hip frame.
    pub(crate) fn foot(&self, leg: usize) -> Planar {
        let at = TRUNK + leg * LEG + FOOT;
        Planar::new(self.numbers[at], self.numbers[at + 1])
    }

    pub(crate) fn set_foot(&mut self, leg: usize, value: Planar) {
        let at = TRUNK + leg * LEG + FOOT;
        self.numbers[at..at + 2].copy_from_slice(value.as_slice());
    }

    /// Components of the foot's absolute velocity in the leg plane, trunk axes.
    pub(crate) fn foot_velocity(&self, leg: usize) -> Planar {
        let at = TRUNK + leg * LEG + FOOT_VELOCITY;
        Planar::new(self.numbers[at], self.numbers[at + 1])
    }

    pub(crate) fn set_foot_velocity(&mut self, leg: usize, value: Planar) {
        let at = TRUNK + leg * LEG + FOOT_VELOCITY;
        self.numbers[at..at + 2].copy_from_slice(value.as_slice());
    }

    scalar!(
        /// Absolute angle of the first segment in the trunk frame.
        hip, set_hip, HIP
    );
    scalar!(
        /// Angle of the cable pulley.
        pulley, set_pulley, PULLEY
    );
    scalar!(hip_rate, set_hip_rate, HIP_RATE);
    scalar!(pulley_rate, set_pulley_rate, PULLEY_RATE);

    /// Sets the velocities to the mean of those of two states.
    pub(crate) fn set_mean_velocities(&mut self, before: &Self, after: &Self, legs: usize) {
        self.set_velocity((before.velocity() + after.velocity()) * 0.5);
        self.set_rate((before.rate() + after.rate()) * 0.5);
        for leg in 0..legs {
            self.set_foot_velocity(
                leg,
                (before.foot_velocity(leg) + after.foot_velocity(leg)) * 0.5,
            );
            self.set_hip_rate(leg, 0.5 * (before.hip_rate(leg) + after.hip_rate(leg)));
            self.set_pulley_rate(
                leg,
                0.5 * (before.pulley_rate(leg) + after.pulley_rate(leg)),
            );
        }
    }

    /// Copies the positions of another state.
    pub(crate) fn copy_positions(&mut self, other: &Self, legs: usize) {
        self.set_position(other.position());
        self.set_attitude(other.attitude());
        for leg in 0..legs {
            self.set_foot(leg, other.foot(leg));
            self.set_hip(leg, other.hip(leg));
            self.set_pulley(leg, other.pulley(leg));
        }
    }

    /// Rotates the attitude by an angular velocity (trunk frame) held for `seconds`: Cayley's map,
    /// of second order and unit length.
    pub(crate) fn turn(&mut self, rate: &Vector3<f64>, seconds: f64) {
        let [w, x, y, z] = self.attitude();
        let half = rate * (0.5 * seconds);
        let turned = [
            w - x * half.x - y * half.y - z * half.z,
            x + w * half.x + y * half.z - z * half.y,
            y + w * half.y + z * half.x - x * half.z,
            z + w * half.z + x * half.y - y * half.x,
        ];
        let square: f64 = turned.iter().map(|c| c * c).sum();
        let scale = 1.0 / libm::sqrt(square);
        self.set_attitude(turned.map(|c| c * scale));
    }

    /// Rotation from trunk to world.
    pub(crate) fn rotation(&self) -> Matrix3<f64> {
        let [w, x, y, z] = self.attitude();
        Matrix3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        )
    }

    /// Whether all components are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.numbers.iter().all(|x| x.is_finite())
    }
}

impl From<State> for Vec<f64> {
    fn from(state: State) -> Self {
        state.numbers.to_vec()
    }
}

impl TryFrom<Vec<f64>> for State {
    type Error = String;

    fn try_from(numbers: Vec<f64>) -> Result<Self, String> {
        let found = numbers.len();
        let numbers = numbers.try_into().map_err(|_| {
            format!(
                "a state of {found} numbers, expected {}",
                TRUNK + LEGS * LEG
            )
        })?;
        Ok(Self { numbers })
    }
}
