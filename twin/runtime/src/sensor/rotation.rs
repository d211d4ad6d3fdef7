/// Number of elements of a quaternion w, x, y, z.
pub(crate) const QUATERNION: usize = 4;

/// Number of axes of a rotation.
pub(super) const AXES: usize = 3;

/// Returns the quaternion `q`, w, x, y, z, followed by the rotation with the vector `turn` \[rad\]
/// in the axes of the rotated body: q ⊗ (cos ½|φ|, sin ½|φ| · φ/|φ|). The norm is that of `q`.
pub(super) fn turned([w, x, y, z]: [f64; QUATERNION], turn: [f64; AXES]) -> [f64; QUATERNION] {
    let angle = libm::sqrt(turn.iter().map(|one| one * one).sum());
    if angle == 0.0 {
        return [w, x, y, z];
    }
    let (cosine, factor) = (libm::cos(0.5 * angle), libm::sin(0.5 * angle) / angle);
    let [a, b, c] = turn.map(|one| one * factor);
    [
        w * cosine - x * a - y * b - z * c,
        w * a + x * cosine + y * c - z * b,
        w * b - x * c + y * cosine + z * a,
        w * c + x * b - y * a + z * cosine,
    ]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

    use super::*;

    /// The body looks to the left and turns about its own x axis, which then is the world's y.
    #[test]
    fn turns_about_the_axes_of_the_body() {
        let left = [FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
        let rolled = turned(left, [FRAC_PI_2, 0.0, 0.0]);
        for (element, expected) in rolled.into_iter().zip([0.5; 4]) {
            assert!((element - expected).abs() < 1e-15, "{rolled:?}");
        }
    }
}
