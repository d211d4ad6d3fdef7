//! A leg of a quadruped.

use nalgebra::Vector3;

use super::bend::Bend;

/// Joint of abduction of a leg.
#[derive(Debug)]
pub(crate) struct Abduction {
    /// Distance of the axis from the hip towards the middle of the trunk, and its height above the
    /// hip \[m\].
    pub(crate) offset: f64,
    pub(crate) height: f64,
    /// Greatest angles outwards and inwards \[rad\].
    pub(crate) outwards: f64,
    pub(crate) inwards: f64,
    /// Viscous friction, if known \[N·m·s/rad\].
    pub(crate) friction: Option<f64>,
    /// Torque \[N·m\] and speed \[rad/s\] of the drive, if known.
    pub(crate) torque: Option<f64>,
    pub(crate) speed: Option<f64>,
}

/// A leg, projected on its plane.
#[derive(Debug)]
pub(crate) struct Leg {
    pub(crate) name: &'static str,
    /// Hip, from the centre of mass of the trunk \[m\].
    pub(crate) hip: Vector3<f64>,
    pub(crate) abduction: Option<Abduction>,
    /// Lengths from hip to knee, knee to ankle and ankle to foot \[m\].
    pub(crate) lengths: [f64; 3],
    /// Distance of the ends of the rod from the joints \[m\].
    pub(crate) l_delta: f64,
    /// Whether it is not that of the description.
    pub(crate) is_l_delta_assumed: bool,
    /// Range of the knee.
    pub(crate) bend: Bend,
    /// Masses of the segments without the foot \[kg\].
    pub(crate) masses: [f64; 3],
    /// Mass of the foot, if it follows from the centre of mass of the last segment \[kg\].
    pub(crate) foot: Option<f64>,
    /// Whether the description has two segments, of which three were made.
    pub(crate) is_divided: bool,
    /// Viscous friction of hip, knee and ankle, if known \[N·m·s/rad\].
    pub(crate) damping: [Option<f64>; 3],
    /// Torque \[N·m\] and speed \[rad/s\] of hip and knee drive, if known.
    pub(crate) torque: [Option<f64>; 2],
    pub(crate) speed: [Option<f64>; 2],
}
