//! Foot locus: target position of a foot as a function of phase.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::{GaitError, StanceCurve};

/// Parameters of a foot locus (thesis, table 3.1), in SI units.
///
/// The sagittal plane has its origin at the hip, x forward and z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocusShape {
    /// H, height of the hip above the stance foot \[m\].
    pub hip_height: f64,
    /// h, lift of the foot in mid-swing \[m\].
    pub step_height: f64,
    /// L, length of the step \[m\].
    pub step_length: f64,
    /// `x_o`, distance of mid-stance in front of the hip \[m\].
    pub mid_stance_offset: f64,
    /// `θ_td` \[rad\]: π/2 touches down vertically, more than π/2 retracts the leg before
    /// touch-down.
    pub touch_down_angle: f64,
    /// `θ_to` \[rad\]: π/2 lifts off vertically, less than π/2 lifts off backwards.
    pub take_off_angle: f64,
    /// c: at 1 the stance is flat, below 1 the foot is (1 − c)·h below the ground at mid-stance.
    pub compression: f64,
}

impl Default for LocusShape {
    /// A moderate step for a leg of about 15 cm: H 138 mm, h 25 mm, L 80 mm, c 0.95, both angles
    /// π/2.
    fn default() -> Self {
        Self {
            hip_height: 0.138,
            step_height: 0.025,
            step_length: 0.08,
            mid_stance_offset: 0.0,
            touch_down_angle: FRAC_PI_2,
            take_off_angle: FRAC_PI_2,
            compression: 0.95,
        }
    }
}

/// Closed curve of the foot.
///
/// The phase Θ follows the thesis, figure 3.3: 0 is take-off, `[0, π)` swing, π touch-down and
/// `[π, 2π)`, the thesis' `[−π, 0)`, stance.
///
/// # Swing
///
/// Two quadratic Bézier curves as in table 3.2 of the thesis, from take-off `(x_o − L/2, −H)` over
/// mid-swing `(x_o, h − H)` to touch-down `(x_o + L/2, −H)`. Their control points lie at the height
/// of mid-swing, so its tangent is horizontal from both sides, and
/// `a = h·tan(θ_to − π/2)` behind or before take-off, `b = h·tan(θ_td − π/2)` before or behind
/// touch-down. With `u = 2Θ/π` in the first half
///
/// ```text
/// x = x_o − L/2·(1 − u²) + 2u(1 − u)·a        z = −H + h·u(2 − u)
/// ```
///
/// and with `v = 2 − 2Θ/π` in the second half the mirror image with `+L/2` and `b`.
///
/// # Stance
///
/// That of a [`StanceCurve`], by default [`StanceCurve::Linear`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootLocus {
    hip_height: f64,
    step_height: f64,
    step_length: f64,
    mid_stance_offset: f64,
    /// a and b.
    swing_reaches: [f64; 2],
    /// Offsets of the control points after touch-down and before take-off.
    stance_reaches: [f64; 2],
    stance_depth: f64,
    stance: StanceCurve,
}

impl FootLocus {
    /// The flattest incidence angle \[rad\]. Table 3.3 allows `[0, π]`, but `tan(θ − π/2)` has
    /// poles at both ends; at a distance of 0.05 rad the control point is 20 step heights away,
    /// beyond any leg.
    pub const INCIDENCE_MIN: f64 = 0.05;
    /// The steepest incidence angle \[rad\], π less [`FootLocus::INCIDENCE_MIN`].
    pub const INCIDENCE_MAX: f64 = PI - Self::INCIDENCE_MIN;

    /// Creates the curve of `shape`.
    ///
    /// # Errors
    ///
    /// A parameter that is not finite, an incidence angle at which the curve has no finite control
    /// point, or a negative `step_height`.
    pub fn new(shape: &LocusShape) -> Result<Self, GaitError> {
        for (what, value) in [
            ("hip_height", shape.hip_height),
            ("step_height", shape.step_height),
            ("step_length", shape.step_length),
            ("mid_stance_offset", shape.mid_stance_offset),
            ("compression", shape.compression),
        ] {
            if !value.is_finite() {
                return Err(GaitError::NotFinite { what, value });
            }
        }
        if shape.step_height < 0.0 {
            return Err(GaitError::OutOfRange {
                what: "step_height",
                value: shape.step_height,
                min: 0.0,
                max: f64::INFINITY,
            });
        }
        let take_off = Self::incidence("take_off_angle", shape.take_off_angle)?;
        let touch_down = Self::incidence("touch_down_angle", shape.touch_down_angle)?;
        let stance_depth = (1.0 - shape.compression) * shape.step_height;
        Ok(Self {
            hip_height: shape.hip_height,
            step_height: shape.step_height,
            step_length: shape.step_length,
            mid_stance_offset: shape.mid_stance_offset,
            swing_reaches: [take_off, touch_down].map(|slope| shape.step_height * slope),
            stance_reaches: [touch_down, take_off].map(|slope| -stance_depth * slope),
            stance_depth,
            stance: StanceCurve::default(),
        })
    }

    /// Returns tan(θ − π/2), within the limits of the angle.
    fn incidence(what: &'static str, angle: f64) -> Result<f64, GaitError> {
        let (min, max) = (Self::INCIDENCE_MIN, Self::INCIDENCE_MAX);
        if !(min..=max).contains(&angle) {
            return Err(GaitError::FlatIncidence {
                what,
                value: angle,
                min,
                max,
            });
        }
        Ok(libm::tan(angle - FRAC_PI_2))
    }

    /// Returns the curve with another stance.
    #[must_use]
    pub fn with_stance(mut self, stance: StanceCurve) -> Self {
        self.stance = stance;
        self
    }

    /// Returns the curve with another step length \[m\], for a ramp that changes it at every step.
    #[must_use]
    pub fn with_step_length(mut self, step_length: f64) -> Self {
        self.step_length = step_length;
        self
    }

    /// Returns the curve with the hip lowered by `by` \[m\].
    #[must_use]
    pub fn with_lowered_hip(mut self, by: f64) -> Self {
        self.hip_height -= by;
        self
    }

    /// Position of the foot at the mid-stance of a flat stance: `[x, z]` relative to the hip \[m\].
    pub(crate) fn mid_stance(&self) -> [f64; 2] {
        [self.mid_stance_offset, -self.hip_height]
    }

    /// Position of the foot at phase Θ in `[0, 2π]`: `[x, z]` relative to the hip \[m\].
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// use twinrig_gait::{FootLocus, LocusShape};
    ///
    /// let locus = FootLocus::new(&LocusShape { step_length: 0.1, ..LocusShape::default() })?;
    /// let [x, z] = locus.point(PI);
    /// assert_eq!([x, z], [0.05, -0.138]); // touch-down: half a step in front of the hip
    /// # Ok::<(), twinrig_gait::GaitError>(())
    /// ```
    #[inline]
    pub fn point(&self, phase: f64) -> [f64; 2] {
        let half = 0.5 * self.step_length;
        let turn = phase * (1.0 / PI);
        if turn < 1.0 {
            return self.bezier(turn, -half, self.swing_reaches, self.step_height);
        }
        let s = turn - 1.0;
        match self.stance {
            StanceCurve::Linear => [
                self.mid_stance_offset + half - self.step_length * s,
                -self.hip_height - self.stance_depth * 4.0 * s * (1.0 - s),
            ],
            StanceCurve::Thesis => self.bezier(s, half, self.stance_reaches, -self.stance_depth),
        }
    }

    /// Two quadratic Bézier curves, of which `part` in `[0, 1]` has passed: from `start` in front
    /// of the middle over a point that is `rise` above the ground to the opposite of `start`.
    #[inline]
    fn bezier(&self, part: f64, start: f64, reaches: [f64; 2], rise: f64) -> [f64; 2] {
        let (u, end, reach) = if part < 0.5 {
            (2.0 * part, start, reaches[0])
        } else {
            (2.0 - 2.0 * part, -start, reaches[1])
        };
        let x = self.mid_stance_offset + end * (1.0 - u * u) + 2.0 * u * (1.0 - u) * reach;
        [x, -self.hip_height + rise * u * (2.0 - u)]
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    pub(crate) fn shapes() -> impl Strategy<Value = LocusShape> {
        (
            0.05..0.15_f64,
            0.0..0.05_f64,
            0.0..0.2_f64,
            -0.05..0.05_f64,
            0.3..2.8_f64,
            0.3..2.8_f64,
            0.0..=1.0_f64,
        )
            .prop_map(|(hip, step, length, offset, down, off, c)| LocusShape {
                hip_height: hip,
                step_height: step,
                step_length: length,
                mid_stance_offset: offset,
                touch_down_angle: down,
                take_off_angle: off,
                compression: c,
            })
    }

    fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
        let (x, z) = (a[0] - b[0], a[1] - b[1]);
        (x * x + z * z).sqrt()
    }

    proptest! {
        #[test]
        fn curve_is_continuous_at_every_joint(shape in shapes()) {
            let locus = FootLocus::new(&shape).unwrap();
            for joint in [FRAC_PI_2, PI, 1.5 * PI] {
                let gap = distance(locus.point(joint - 1e-9), locus.point(joint + 1e-9));
                prop_assert!(gap < 1e-8, "{gap} at {joint}");
            }
            prop_assert!(distance(locus.point(0.0), locus.point(2.0 * PI)) < 1e-15);
        }

        #[test]
        fn stance_has_constant_speed(shape in shapes(), phase in PI..1.98 * PI) {
            let locus = FootLocus::new(&shape).unwrap();
            let h = 0.01;
            let slope = (locus.point(phase + h)[0] - locus.point(phase)[0]) / h;
            prop_assert!((slope + shape.step_length / PI).abs() < 1e-12, "{slope}");
        }

        #[test]
        fn key_points_are_those_of_table_3_2(shape in shapes()) {
            let locus = FootLocus::new(&shape).unwrap();
            let LocusShape { hip_height, step_height, step_length, mid_stance_offset: x_o, compression, .. } = shape;
            let depth = (1.0 - compression) * step_height;
            for (phase, x, z) in [
                (0.0, x_o - step_length / 2.0, -hip_height),
                (FRAC_PI_2, x_o, step_height - hip_height),
                (PI, x_o + step_length / 2.0, -hip_height),
                (1.5 * PI, x_o, -hip_height - depth),
            ] {
                prop_assert!(distance(locus.point(phase), [x, z]) < 1e-15);
            }
        }

        #[test]
        fn incidence_is_the_slope_at_the_ends_of_swing(shape in shapes()) {
            prop_assume!(shape.step_height > 1e-3);
            let locus = FootLocus::new(&shape).unwrap();
            let h = 1e-7;
            let off = locus.point(h);
            let start = locus.point(0.0);
            // The tangent of take-off makes the angle θ_to with the backward direction, that of
            // touch-down the angle θ_td with the forward direction of the time-reversed motion.
            let take_off = libm::atan2(off[1] - start[1], -(off[0] - start[0]));
            prop_assert!((take_off - shape.take_off_angle).abs() < 1e-3);
            let down = locus.point(PI - h);
            let end = locus.point(PI);
            let touch_down = libm::atan2(down[1] - end[1], -(down[0] - end[0]));
            prop_assert!((touch_down - shape.touch_down_angle).abs() < 1e-3, "{touch_down}");
        }

        #[test]
        fn swing_stays_between_ground_and_step_height(shape in shapes(), phase in 0.0..PI) {
            let locus = FootLocus::new(&shape).unwrap();
            let lift = locus.point(phase)[1] + shape.hip_height;
            prop_assert!((-1e-15..=shape.step_height + 1e-15).contains(&lift));
        }
    }

    #[test]
    fn retraction_moves_the_foot_backwards_before_touch_down() {
        let shape = LocusShape {
            touch_down_angle: 1.9,
            ..LocusShape::default()
        };
        let locus = FootLocus::new(&shape).unwrap();
        assert!(locus.point(PI - 0.05)[0] > locus.point(PI)[0]);
    }

    #[test]
    fn flat_incidence_is_a_typed_error() {
        for angle in [0.0, PI, 0.049, f64::NAN, -1.0] {
            let shape = LocusShape {
                touch_down_angle: angle,
                ..LocusShape::default()
            };
            let error = FootLocus::new(&shape).unwrap_err();
            assert!(matches!(
                error,
                GaitError::FlatIncidence {
                    what: "touch_down_angle",
                    ..
                }
            ));
        }
        let shape = LocusShape {
            step_length: f64::INFINITY,
            ..LocusShape::default()
        };
        assert!(matches!(
            FootLocus::new(&shape),
            Err(GaitError::NotFinite { .. })
        ));
    }
}
