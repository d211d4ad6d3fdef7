//! Duty map: from the uniform phase of an oscillator to the phase of the foot locus.

use std::f64::consts::PI;

use crate::GaitError;

/// Phase map with an exact stance share of the cycle.
///
/// Eq. 3.1 of the thesis does not give the desired duty factor: its second branch reaches the end
/// of stance after a share of (1 + d)/2, so that 0.5 is realised as 0.75. Here swing is the first 1
/// − d of a cycle and stance the last d, each at constant speed:
///
/// ```text
/// Θ = π·t/(1 − d)                  for t < 1 − d
/// Θ = π + π·(t − (1 − d))/d        otherwise          t in [0, 1), fraction of the cycle
/// ```
///
/// Take-off (Θ = 0) keeps its time and touch-down (Θ = π) is at t = 1 − d, as in the text of the
/// thesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DutyMap {
    swing_share: f64,
    swing_slope: f64,
    stance_slope: f64,
}

impl DutyMap {
    /// Creates the map for the duty factor `d`, strictly between 0 and 1.
    ///
    /// # Errors
    ///
    /// A duty factor outside `(0, 1)`, or so close to its limits that a share vanishes in `f64`.
    pub fn new(duty_factor: f64) -> Result<Self, GaitError> {
        let swing_share = 1.0 - duty_factor;
        let map = Self {
            swing_share,
            swing_slope: PI / swing_share,
            stance_slope: PI / duty_factor,
        };
        let inside = duty_factor > 0.0 && duty_factor < 1.0 && swing_share < 1.0;
        if !inside || !map.stance_slope.is_finite() {
            return Err(GaitError::OutOfRange {
                what: "duty_factor",
                value: duty_factor,
                min: 0.0,
                max: 1.0,
            });
        }
        Ok(map)
    }

    /// Phase Θ in `[0, 2π]` of the locus at the fraction `turn` in `[0, 1)` of a cycle.
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// let map = twinrig_gait::DutyMap::new(0.25)?;
    /// assert_eq!(map.phase(0.0), 0.0); // take-off
    /// assert_eq!(map.phase(0.75), PI); // touch-down: stance has the last quarter
    /// # Ok::<(), twinrig_gait::GaitError>(())
    /// ```
    #[inline]
    pub fn phase(&self, turn: f64) -> f64 {
        if turn < self.swing_share {
            // Rounding could give exactly π, which is stance.
            (turn * self.swing_slope).min(PI.next_down())
        } else {
            PI + (turn - self.swing_share) * self.stance_slope
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn realised_stance_share_equals_the_duty_factor(d in 0.001..0.999_f64, offset in 0.0..1e-4_f64) {
            let map = DutyMap::new(d).unwrap();
            let count = 10_000;
            let stance = (0..count)
                .filter(|&k| map.phase(f64::from(k) / f64::from(count) + offset * 0.99) >= PI)
                .count();
            prop_assert!((stance as f64 / f64::from(count) - d).abs() <= 1.001 / f64::from(count));
        }

        #[test]
        fn map_is_continuous_and_increasing(d in 0.001..0.999_f64, t in 0.0..0.999_f64, step in 1e-9..1e-3_f64) {
            let map = DutyMap::new(d).unwrap();
            let (a, b) = (map.phase(t), map.phase(t + step));
            prop_assert!(b > a);
            prop_assert!(b - a <= step * PI / d.min(1.0 - d) * (1.0 + 1e-6) + 1e-12);
            prop_assert!((map.phase(1.0_f64.next_down()) - 2.0 * PI).abs() < 1e-9);
        }

        #[test]
        fn speed_is_constant_within_swing_and_within_stance(d in 0.01..0.99_f64, share in 0.05..0.9_f64) {
            let map = DutyMap::new(d).unwrap();
            let swing = share * (1.0 - d);
            prop_assert!((map.phase(swing) - share * PI).abs() < 1e-12);
            let stance = (1.0 - d) + share * d;
            prop_assert!((map.phase(stance) - PI - share * PI).abs() < 1e-12);
        }
    }

    #[test]
    fn limits_of_the_range_are_typed_errors() {
        for d in [0.0, 1.0, -0.1, 1.1, f64::NAN, f64::INFINITY, 1e-320, 1e-17] {
            assert!(
                matches!(DutyMap::new(d), Err(GaitError::OutOfRange { .. })),
                "{d}"
            );
        }
    }
}
