//! Frame of the trunk.

/// Returns a point of the world in the frame of a trunk with this attitude (w, x, y, z). Relative
/// to it, a hip does not move.
pub(crate) fn in_trunk(point: [f64; 3], trunk: [f64; 3], [w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let [a, b, c]: [f64; 3] = core::array::from_fn(|n| point[n] - trunk[n]);
    // v + 2 q × (q × v + w v), with the vector part of the conjugate.
    let (x, y, z) = (-x, -y, -z);
    let [d, e, f] = [
        y * c - z * b + w * a,
        z * a - x * c + w * b,
        x * b - y * a + w * c,
    ];
    [
        a + 2.0 * (y * f - z * e),
        b + 2.0 * (z * d - x * f),
        c + 2.0 * (x * e - y * d),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn point_fixed_to_the_trunk_stays_in_place_in_its_frame() {
        // A quarter turn about z: x of the trunk is y of the world.
        let half = core::f64::consts::FRAC_1_SQRT_2;
        let found = in_trunk([1.0, 5.0, 4.0], [1.0, 2.0, 3.0], [half, 0.0, 0.0, half]);
        for (found, expected) in found.into_iter().zip([3.0, 0.0, 1.0]) {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
    }
}
