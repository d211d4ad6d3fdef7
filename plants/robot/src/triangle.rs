//! Geometry of triangles.

use libm::{cos, sqrt};

/// Returns the third side of a triangle whose two others turn by an angle where they meet (thesis,
/// appendix A: `l_d² = l2² + lΔ² + 2 l2 lΔ cos q2`) \[m\].
pub(crate) fn third_side(p: f64, q: f64, angle: f64) -> f64 {
    sqrt(p * p + q * q + 2.0 * p * q * cos(angle))
}
