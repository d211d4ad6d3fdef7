//! Measurements of a plant.

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::{Ground, Surface};
use twinrig_runtime::EnergyBalance;

use crate::LEGS;

/// Motion of a foot, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FootMotion {
    /// \[m\]
    pub position: Vector3<f64>,
    /// \[m/s\]
    pub velocity: Vector3<f64>,
}

/// Measurements of a plant at one instant: world axes (x forward, y left, z up) and SI units unless
/// stated otherwise.
///
/// [`Signals::write`](crate::Signals::write) calls only the methods of selected signals, and those
/// that return the measurements of all legs once per observation. Legs are indexed in the order of
/// the ports. Measurements that require drives or ground are not called without them.
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

    /// Returns the angle of abduction, positive to the left \[rad\]; called only of legs with such
    /// a joint.
    fn abduction(&self, _leg: usize) -> f64 {
        0.0
    }

    /// Returns the rate of that angle \[rad/s\]; called only of legs with such a joint.
    fn abduction_rate(&self, _leg: usize) -> f64 {
        0.0
    }

    /// Returns the torque of its drive on the leg, mean over the last step \[N·m\]; called only of
    /// legs with such a joint.
    fn abduction_torque(&self, _leg: usize) -> f64 {
        0.0
    }

    /// Returns the absolute angles of the three segments in the leg plane, zero pointing straight
    /// down \[rad\].
    fn angles(&self, leg: usize) -> [f64; 3];

    /// Returns the motion of all feet; entries beyond the last leg are unused.
    fn feet(&self) -> [FootMotion; LEGS];

    /// Returns the ground below each leg, whose feet are at `feet`: the clearance of its contact
    /// point above the ground, along the normal \[m\], and the normal.
    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS];

    /// Returns the impulse of the ground on the foot since the start \[N·s\].
    fn ground_impulse(&self, leg: usize) -> [f64; 3];

    /// Returns the impulse of the ground on knee and ankle since the start \[N·s\]; called only of
    /// legs with such a contact.
    fn segments_impulse(&self, _leg: usize) -> [f64; 3] {
        [0.0; 3]
    }

    /// Returns the impulse of the ground on the trunk since the start \[N·s\]; called only of
    /// trunks with such a contact.
    fn trunk_impulse(&self) -> [f64; 3] {
        [0.0; 3]
    }
}

/// Returns the ground below each foot; without ground, a level one at infinite distance.
pub fn surfaces_below(ground: Option<&Ground>, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
    feet.map(|foot| match ground {
        Some(ground) => ground.below(&foot.position),
        None => Surface {
            gap: f64::INFINITY,
            normal: Vector3::z(),
        },
    })
}
