//! What a plant can be asked for.

use nalgebra::{Matrix3, Vector3};
use twinrig_runtime::EnergyBalance;

/// What is measured of a plant at one instant: world axes (x forward, y left, z up) and SI units unless said otherwise.
///
/// [`Signals::write`](crate::Signals::write) asks only for what is wanted. Legs are counted in the order of the ports. What
/// needs drives or ground is never asked for without them.
pub trait Readings {
    /// The trunk's centre of mass \[m\].
    fn position(&self) -> Vector3<f64>;

    /// Attitude of the trunk as a quaternion w, x, y, z from trunk to world.
    fn attitude(&self) -> [f64; 4];

    /// The same as a matrix.
    fn rotation(&self) -> Matrix3<f64>;

    /// Velocity of the trunk's centre of mass \[m/s\].
    fn velocity(&self) -> Vector3<f64>;

    /// Angular velocity of the trunk, in the trunk's own axes \[rad/s\].
    fn angular_velocity(&self) -> Vector3<f64>;

    /// Where energy is, and where it went \[J\].
    fn energy(&self) -> EnergyBalance;

    /// Hip angle q1, zero in the reference pose \[rad\].
    fn hip(&self, leg: usize) -> f64;

    /// Its rate \[rad/s\].
    fn hip_rate(&self, leg: usize) -> f64;

    /// Torque of the hip drive on the leg, mean over the last step \[N·m\].
    fn hip_torque(&self, leg: usize) -> f64;

    /// Angle of the cable pulley, zero with the leg extended \[rad\].
    fn pulley(&self, leg: usize) -> f64;

    /// Its rate \[rad/s\].
    fn pulley_rate(&self, leg: usize) -> f64;

    /// Torque of the knee drive on the pulley, mean over the last step \[N·m\].
    fn knee_torque(&self, leg: usize) -> f64;

    /// Tension of the cable, mean over the last step \[N\].
    fn cable_tension(&self, leg: usize) -> f64;

    /// Absolute angles of the three segments in the leg plane, zero pointing straight down \[rad\].
    fn angles(&self, leg: usize) -> [f64; 3];

    /// The foot \[m\].
    fn foot_position(&self, leg: usize) -> Vector3<f64>;

    /// Its velocity \[m/s\].
    fn foot_velocity(&self, leg: usize) -> Vector3<f64>;

    /// Impulse of the ground on the leg since the start \[N·s\].
    fn ground_impulse(&self, leg: usize) -> [f64; 3];

    /// The ground's normal below the foot.
    fn ground_normal(&self, leg: usize) -> Vector3<f64>;

    /// How far the foot is above the ground, along the normal \[m\].
    fn clearance(&self, leg: usize) -> f64;
}
