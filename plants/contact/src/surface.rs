//! The ground below a point.

use nalgebra::Vector3;

/// The ground below a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Distance of the point above the ground, measured along the normal \[m\].
    pub gap: f64,
    /// Upward unit normal.
    pub normal: Vector3<f64>,
}

impl Surface {
    /// Returns two unit tangents, the first in the vertical plane of x.
    pub fn tangents(&self) -> [Vector3<f64>; 2] {
        let forward = Vector3::new(self.normal.z, 0.0, -self.normal.x).normalize();
        [forward, self.normal.cross(&forward)]
    }
}

#[inline]
pub(crate) fn level(gap: f64) -> Surface {
    Surface {
        gap,
        normal: Vector3::z(),
    }
}
