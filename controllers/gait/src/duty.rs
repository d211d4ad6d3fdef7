//! Duty map: from the uniform phase of an oscillator to the phase of the foot locus.

use std::f64::consts::PI;

use crate::GaitError;

/// Stance share of the cycle that a duty factor d sets.
///
/// Eq. 3.1 of the thesis is, with θ = 2π·t for the fraction t in `[0, 1)` of a cycle,
///
/// ```text
/// Θ = θ/(1 − d)                    for θ < π(1 − d)
/// Θ = (θ + 2π·d)/(1 + d)           otherwise
/// ```
///
/// Both branches are π at θ = π(1 − d), t = (1 − d)/2, and the second ends with Θ = 2π at t = 1:
/// swing takes a share of (1 − d)/2, stance one of (1 + d)/2, each at constant speed. The map of
/// the thesis is thus a [`DutyMap`] of that share, which is above one half for every d: 0.5 is
/// realised as 0.75. The text would have touch-down at θ = 2π(1 − d), as [`DutyRule::Corrected`]
/// has it.
///
/// The phase has to be within `[0, 2π)`: the first branch has no lower limit, and the thesis'
/// `[−π, 0)` for stance gives Θ = −π/(1 − d) at its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DutyRule {
    /// d.
    #[default]
    Corrected,
    /// (1 + d)/2, as eq. 3.1 is printed.
    Thesis,
}

impl DutyRule {
    /// All rules.
    pub const ALL: [Self; 2] = [Self::Corrected, Self::Thesis];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Corrected => "corrected",
            Self::Thesis => "thesis",
        }
    }

    /// Stance share of the cycle for the duty factor `d`.
    ///
    /// ```
    /// use twinrig_gait::DutyRule;
    /// assert_eq!(DutyRule::Corrected.stance_share(0.5), 0.5);
    /// assert_eq!(DutyRule::Thesis.stance_share(0.5), 0.75);
    /// ```
    pub fn stance_share(self, duty_factor: f64) -> f64 {
        match self {
            Self::Corrected => duty_factor,
            Self::Thesis => 0.5 * (1.0 + duty_factor),
        }
    }
}

/// Phase map with an exact stance share of the cycle.
///
/// Swing is the first 1 − d of a cycle and stance the last d, each at constant speed:
///
/// ```text
/// Θ = π·t/(1 − d)                  for t < 1 − d
/// Θ = π + π·(t − (1 − d))/d        otherwise          t in [0, 1), fraction of the cycle
/// ```
///
/// Take-off (Θ = 0) keeps its time and touch-down (Θ = π) is at t = 1 − d, as in the text of the
/// thesis. Its formula has another stance share ([`DutyRule`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DutyMap {
    swing_share: f64,
    swing_slope: f64,
    stance_slope: f64,
}

impl DutyMap {
    /// Returns the share of stance in a cycle.
    pub fn stance_share(&self) -> f64 {
        1.0 - self.swing_share
    }

    /// Creates the map for the duty factor `d`, strictly between 0 and 1.
    ///
    /// # Errors
    ///
    /// A duty factor outside `(0, 1)`, or so close to its limits that a share vanishes in `f64`.
    pub fn new(duty_factor: f64) -> Result<Self, GaitError> {
        Self::with_rule(DutyRule::Corrected, duty_factor)
    }

    /// Creates the map whose stance share is that of `rule` for the duty factor `d`, strictly
    /// between 0 and 1.
    ///
    /// # Errors
    ///
    /// As [`DutyMap::new`].
    pub fn with_rule(rule: DutyRule, duty_factor: f64) -> Result<Self, GaitError> {
        let stance_share = rule.stance_share(duty_factor);
        let swing_share = 1.0 - stance_share;
        let map = Self {
            swing_share,
            swing_slope: PI / swing_share,
            stance_slope: PI / stance_share,
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

        #[test]
        fn map_of_the_thesis_is_eq_3_1(d in 0.001..0.999_f64, t in 0.0..1.0_f64) {
            let map = DutyMap::with_rule(DutyRule::Thesis, d).unwrap();
            let theta = 2.0 * PI * t;
            let printed = if theta < PI * (1.0 - d) {
                theta / (1.0 - d)
            } else {
                (theta + 2.0 * PI * d) / (1.0 + d)
            };
            prop_assert!((map.phase(t) - printed).abs() < 1e-12);
            prop_assert!((map.phase(1.0_f64.next_down()) - 2.0 * PI).abs() < 1e-12);
        }

        #[test]
        fn stance_share_of_the_thesis_is_the_mean_of_one_and_the_duty_factor(d in 0.001..0.999_f64) {
            let map = DutyMap::with_rule(DutyRule::Thesis, d).unwrap();
            let count = 10_000;
            let stance = (0..count)
                .filter(|&k| map.phase(f64::from(k) / f64::from(count)) >= PI)
                .count();
            let share = stance as f64 / f64::from(count);
            prop_assert!((share - 0.5 * (1.0 + d)).abs() <= 1.001 / f64::from(count), "{share}");
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
        for d in [0.0, 1.0, -0.1, 1.1, f64::NAN, f64::INFINITY] {
            assert!(
                matches!(
                    DutyMap::with_rule(DutyRule::Thesis, d),
                    Err(GaitError::OutOfRange { .. })
                ),
                "{d}"
            );
        }
    }
}
