//! Curve of the foot in stance.

/// Curve of the foot in stance.
///
/// Table 3.2 of the thesis gives the stance curves control points of the same kind as those of the
/// swing, `(1 − c)·h` below the ground and offset by `−(1 − c)·h·tan(θ − π/2)`. With `s = Θ/π − 1`,
/// `u = 2s` and a, b as in the swing, the first half of [`StanceCurve::Thesis`] is
///
/// ```text
/// x = x_o + L/2·(1 − u²) − 2u(1 − u)·(1 − c)·b        z = −H − (1 − c)·h·u(2 − u)
/// ```
///
/// and with `u = 2 − 2s` the second half is the mirror image with `−L/2` and `a`. That contradicts
/// the text, which requires a foot that follows the phase linearly: at c = 1 the control point
/// coincides with the end point, so the foot has zero speed at touch-down and take-off and passes
/// mid-stance at twice the mean speed; on the ground that is slip.
///
/// A quadratic Bézier curve has `dx/du = 2[(1 − u)(x₁ − x₀) + u(x₂ − x₁)]`, which is constant if
/// and only if its control point is midway, `x₁ = (x₀ + x₂)/2`. In [`StanceCurve::Linear`] the
/// control points of both stance curves therefore keep their height and move to the middle of
/// their x-interval:
///
/// ```text
/// x = x_o + L/2 − L·s                        z = −H − (1 − c)·h·4s(1 − s)
/// ```
///
/// one parabola through the three key points of table 3.2, traversed at the constant speed −L/π per
/// radian of phase. In time that is L·f/d for a gait of frequency f and duty factor d: the speed at
/// which a body passes over its feet without slip. The two incidence angles act on the swing only,
/// where the intended leg retraction takes place. At every phase the height is the same in both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StanceCurve {
    /// Through the key points of table 3.2 at constant speed.
    #[default]
    Linear,
    /// With the control points of table 3.2 as they are printed.
    Thesis,
}

impl StanceCurve {
    /// All curves.
    pub const ALL: [Self; 2] = [Self::Linear, Self::Thesis];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Thesis => "thesis",
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;
    use crate::locus::tests::shapes;
    use crate::{FootLocus, LocusShape};

    fn thesis(shape: &LocusShape) -> FootLocus {
        FootLocus::new(shape)
            .unwrap()
            .with_stance(StanceCurve::Thesis)
    }

    /// Point of a quadratic Bézier curve by its three points.
    fn bezier(points: [[f64; 2]; 3], u: f64) -> [f64; 2] {
        let shares = [(1.0 - u) * (1.0 - u), 2.0 * u * (1.0 - u), u * u];
        [0, 1].map(|axis| (0..3).map(|n| shares[n] * points[n][axis]).sum())
    }

    /// `dx/du` of the half of the stance that ends or begins at mid-stance, u from touch-down on.
    fn speed(locus: &FootLocus, u: f64) -> f64 {
        let phase = |u: f64| PI * (1.0 + 0.5 * u);
        let h = 1e-6;
        (locus.point(phase(u + h))[0] - locus.point(phase(u - h))[0]) / (2.0 * h)
    }

    proptest! {
        /// The points as table 3.2 prints them.
        #[test]
        fn stance_has_the_printed_control_points(shape in shapes(), u in 0.0..1.0_f64) {
            let LocusShape { hip_height, step_height: h, step_length: l, mid_stance_offset: x_o, touch_down_angle, take_off_angle, compression: c } = shape;
            let low = -hip_height - (1.0 - c) * h;
            let offset = |angle: f64| -(1.0 - c) * h * libm::tan(angle - FRAC_PI_2);
            let middle = [x_o, low];
            let touch_down = [
                [x_o + l / 2.0, -hip_height],
                [x_o + l / 2.0 + offset(touch_down_angle), low],
                middle,
            ];
            let take_off = [
                middle,
                [x_o - l / 2.0 + offset(take_off_angle), low],
                [x_o - l / 2.0, -hip_height],
            ];
            let locus = thesis(&shape);
            for (begin, points) in [(PI, touch_down), (1.5 * PI, take_off)] {
                let (found, expected) = (locus.point(begin + FRAC_PI_2 * u), bezier(points, u));
                for axis in [0, 1] {
                    prop_assert!((found[axis] - expected[axis]).abs() < 1e-12);
                }
            }
        }

        #[test]
        fn stance_is_continuous_and_meets_the_swing(shape in shapes()) {
            let locus = thesis(&shape);
            for joint in [PI, 1.5 * PI] {
                let (before, after) = (locus.point(joint - 1e-9), locus.point(joint + 1e-9));
                for axis in [0, 1] {
                    prop_assert!((before[axis] - after[axis]).abs() < 1e-8, "{joint}");
                }
            }
            let (first, last) = (locus.point(0.0), locus.point(2.0 * PI));
            for axis in [0, 1] {
                prop_assert!((first[axis] - last[axis]).abs() < 1e-15);
            }
        }

        #[test]
        fn curves_differ_in_the_place_of_the_stance_foot_alone(shape in shapes(), phase in 0.0..2.0 * PI) {
            let linear = FootLocus::new(&shape).unwrap();
            let (thesis, linear) = (thesis(&shape).point(phase), linear.point(phase));
            prop_assert!((thesis[1] - linear[1]).abs() < 1e-15);
            prop_assert!(phase >= PI || thesis[0].to_bits() == linear[0].to_bits());
        }

        /// The foot that the text calls linear in the phase.
        #[test]
        fn flat_stance_stops_at_both_ends_and_has_twice_the_mean_speed_at_its_middle(
            shape in shapes(), u in 0.01..0.99_f64,
        ) {
            let shape = LocusShape { compression: 1.0, ..shape };
            let (locus, mean) = (thesis(&shape), -0.5 * shape.step_length);
            prop_assert!((speed(&locus, u) - 2.0 * mean * u).abs() < 1e-6);
            prop_assert!((speed(&locus, 2.0 - u) - 2.0 * mean * u).abs() < 1e-6);
        }
    }

    #[test]
    fn names_are_unique() {
        let [first, second] = StanceCurve::ALL.map(StanceCurve::name);
        assert_ne!(first, second);
    }
}
