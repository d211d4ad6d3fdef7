//! Measurements of a plant.

use nalgebra::{Matrix3, Vector3};
use twinrig_runtime::EnergyBalance;

/// Measurements of a plant at one instant: world axes (x forward, y left, z up) and SI units unless
/// stated otherwise.
///
/// [`Signals::write`](crate::Signals::write) calls only the methods of selected signals. Legs are
/// indexed in the order of the ports. Measurements that require drives or ground are not called
/// without them.
pub trait Readings {
    /// Returns the position of the trunk's centre of mass \[m\].
    fn position(&self) -> Vector3<f64>;

    /// Returns the attitude of the trunk as a quaternion w, x, y, z from trunk to world.
    fn attitude(&self) -> [f64; 4];

    /// Returns the attitude as a rotation matrix.
    fn rotation(&self) -> Matrix3<f64>;

    /// Returns the velocity of the trunk's centre of mass \[m/s\].
    fn velocity(&self) -> Vector3<f64>;

    /// Returns the angular velocity of the trunk in trunk axes \[rad/s\].
    fn angular_velocity(&self) -> Vector3<f64>;

    /// Returns the energy balance \[J\].
    fn energy(&self) -> EnergyBalance;

    /// Returns the hip angle q1, zero in the reference pose \[rad\].
    fn hip(&self, leg: usize) -> f64;

    /// Returns the rate of the hip angle \[rad/s\].
    fn hip_rate(&self, leg: usize) -> f64;

    /// Returns the torque of the hip drive on the leg, mean over the last step \[N·m\].
    fn hip_torque(&self, leg: usize) -> f64;

    /// Returns the angle of the cable pulley, zero with the leg extended \[rad\].
    fn pulley(&self, leg: usize) -> f64;

    /// Returns the rate of the pulley angle \[rad/s\].
    fn pulley_rate(&self, leg: usize) -> f64;

    /// Returns the torque of the knee drive on the pulley, mean over the last step \[N·m\].
    fn knee_torque(&self, leg: usize) -> f64;

    /// Returns the tension of the cable, mean over the last step \[N\].
    fn cable_tension(&self, leg: usize) -> f64;

    /// Returns the absolute angles of the three segments in the leg plane, zero pointing straight
    /// down \[rad\].
    fn angles(&self, leg: usize) -> [f64; 3];

    /// Returns the position of the foot \[m\].
    fn foot_position(&self, leg: usize) -> Vector3<f64>;

    /// Returns the velocity of the foot \[m/s\].
    fn foot_velocity(&self, leg: usize) -> Vector3<f64>;

    /// Returns the impulse of the ground on the leg since the start \[N·s\].
    fn ground_impulse(&self, leg: usize) -> [f64; 3];

    /// Returns the ground normal below the foot.
    fn ground_normal(&self, leg: usize) -> Vector3<f64>;

    /// Returns the clearance of the foot above the ground, along the normal \[m\].
    fn clearance(&self, leg: usize) -> f64;
}
