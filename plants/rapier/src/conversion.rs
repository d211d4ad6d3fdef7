//! Conversions between the engine's vectors and nalgebra's, attitudes of links, and the engine's
//! number of an axis.

use nalgebra::Vector3;
use rapier3d_f64::math::{Rotation, Vector};

/// Index of the angular x axis in the engine's lists.
pub(crate) const ANGULAR: usize = 3;

pub(crate) fn to_nalgebra(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(crate) fn to_engine(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Returns a quaternion as w, x, y, z.
pub(crate) fn wxyz(rotation: Rotation) -> [f64; 4] {
    [rotation.w, rotation.x, rotation.y, rotation.z]
}

/// Returns the rotation of a quaternion w, x, y, z of any norm; none where the norm is zero or not
/// finite.
pub(crate) fn rotation([w, x, y, z]: [f64; 4]) -> Option<Rotation> {
    let square = w * w + x * x + y * y + z * z;
    let by = 1.0 / libm::sqrt(square);
    by.is_finite()
        .then(|| Rotation::from_xyzw(x * by, y * by, z * by, w * by))
}

/// Returns the attitude of a link at this angle relative to the trunk: zero points straight down,
/// positive swings forward.
pub(crate) fn link_attitude(angle: f64) -> Rotation {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Rotation::from_xyzw(0.0, -sin, 0.0, cos)
}

/// Returns the attitude of the carrier of a leg at this angle of abduction relative to the trunk.
pub(crate) fn abducted(angle: f64) -> Rotation {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Rotation::from_xyzw(sin, 0.0, 0.0, cos)
}
