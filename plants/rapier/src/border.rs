//! Between the engine's vectors and everybody else's.

use nalgebra::Vector3;
use rapier3d_f64::math::{Rotation, Vector};

pub(crate) fn outside(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

pub(crate) fn inside(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// A quaternion as w, x, y, z.
pub(crate) fn wxyz(rotation: Rotation) -> [f64; 4] {
    [rotation.w, rotation.x, rotation.y, rotation.z]
}

/// The rotation of a quaternion w, x, y, z that need not have length one; none where it has no length.
pub(crate) fn rotation([w, x, y, z]: [f64; 4]) -> Option<Rotation> {
    let square = w * w + x * x + y * y + z * z;
    let by = 1.0 / libm::sqrt(square);
    by.is_finite()
        .then(|| Rotation::from_xyzw(x * by, y * by, z * by, w * by))
}

/// The attitude, against the trunk, of a link at this angle: zero points straight down, positive swings forward.
pub(crate) fn swung(angle: f64) -> Rotation {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Rotation::from_xyzw(0.0, -sin, 0.0, cos)
}
