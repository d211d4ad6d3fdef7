//! Limits of a measured value.

use std::f64::consts::PI;
use std::ops::Bound;

use twinrig_document::Range;
use twinrig_kernel::Unit;

use crate::gait::Fitness;

/// Least and greatest accepted value, at least one of which is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Least accepted value, inclusive.
    pub min: Option<f64>,
    /// Greatest accepted value, inclusive.
    pub max: Option<f64>,
}

/// Possible values of a measure. Limits that accept all of them or none would give a verdict that
/// does not depend on the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Domain {
    range: Range,
    is_integer: bool,
}

impl Domain {
    pub const ANY: Domain = Domain::of(Range::ANY);
    pub const POSITIVE: Domain = Domain::of(Range::POSITIVE);
    pub const NOT_NEGATIVE: Domain = Domain::of(Range::NOT_NEGATIVE);
    /// Non-negative integers.
    pub const COUNT: Domain = Domain {
        range: Range::NOT_NEGATIVE,
        is_integer: true,
    };
    /// Shares, 0 to 1.
    pub const SHARE: Domain = Domain::up_to(1.0);
    /// Coefficients of correlation, −1 to 1.
    pub const CORRELATION: Domain = Domain::of(Range {
        min: Bound::Included(-1.0),
        max: Bound::Included(1.0),
    });
    /// Staged fitness of a gait.
    pub const FITNESS: Domain = Domain::up_to(Fitness::END);
    /// Magnitude of a roll; peak-to-peak range of a pitch.
    pub const HALF_TURN: Domain = Domain::up_to(PI);
    /// Magnitude of a pitch, at most a quarter turn up or down.
    pub const QUARTER_TURN: Domain = Domain::up_to(PI / 2.0);
    /// Peak-to-peak range of a roll.
    pub const TURN: Domain = Domain::up_to(2.0 * PI);

    const fn of(range: Range) -> Self {
        Domain {
            range,
            is_integer: false,
        }
    }

    const fn up_to(max: f64) -> Self {
        Domain::of(Range {
            min: Bound::Included(0.0),
            max: Bound::Included(max),
        })
    }

    /// Returns whether all values are within `limits`.
    pub fn is_within(&self, limits: &Limits) -> bool {
        // The conversion of degrees to radians has a rounding error in the last place.
        const ROUNDING: f64 = 1.0 - 1e-12;
        let above = match (limits.min, self.range.min) {
            (None, _) => true,
            (Some(min), Bound::Included(least) | Bound::Excluded(least)) => min <= least,
            (Some(_), Bound::Unbounded) => false,
        };
        let below = match (limits.max, self.range.max) {
            (None, _) => true,
            (Some(max), Bound::Included(most) | Bound::Excluded(most)) => max >= most * ROUNDING,
            (Some(_), Bound::Unbounded) => false,
        };
        above && below
    }

    /// Returns whether no value is within `limits`.
    pub fn is_outside(&self, limits: &Limits) -> bool {
        let below = match (limits.max, self.range.min) {
            (Some(max), Bound::Included(least)) => max < least,
            (Some(max), Bound::Excluded(least)) => max <= least,
            _ => false,
        };
        let above = match (limits.min, self.range.max) {
            (Some(min), Bound::Included(most)) => min > most,
            (Some(min), Bound::Excluded(most)) => min >= most,
            _ => false,
        };
        let between = match (limits.min, limits.max) {
            (Some(min), Some(max)) => self.is_integer && max.floor() < min.ceil(),
            _ => false,
        };
        below || above || between
    }

    pub fn describe(&self, unit: Unit) -> String {
        let prefix = if self.is_integer {
            "a whole number, "
        } else {
            ""
        };
        format!("{prefix}{}", self.range.words(unit.symbol()))
    }
}

/// Comparison of values with [`Limits`]: the value with the least margin, the limit closest to it,
/// and the signed distance, negative if the limit is violated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The value.
    pub measured: f64,
    /// The limit.
    pub bound: f64,
    /// Distance to the limit; negative if the limit is violated; NaN if the value is NaN.
    pub margin: f64,
    /// The opposite limit, if there is one.
    pub other: Option<f64>,
}

impl Limits {
    /// Returns limits with only a maximum.
    pub const fn at_most(max: f64) -> Self {
        Limits {
            min: None,
            max: Some(max),
        }
    }

    /// Compares the values from `least` to `greatest` with the limits.
    pub fn compare(&self, least: f64, greatest: f64) -> Comparison {
        let above = self.max.map(|max| Comparison {
            measured: greatest,
            bound: max,
            margin: max - greatest,
            other: self.min,
        });
        let below = self.min.map(|min| Comparison {
            measured: least,
            bound: min,
            margin: least - min,
            other: self.max,
        });
        match (below, above) {
            // A NaN on either side takes precedence.
            (Some(below), Some(above))
                if above.margin.is_nan()
                    || (!below.margin.is_nan() && above.margin < below.margin) =>
            {
                above
            }
            (Some(comparison), _) | (None, Some(comparison)) => comparison,
            (None, None) => Comparison {
                measured: greatest,
                bound: f64::NAN,
                margin: f64::NAN,
                other: None,
            },
        }
    }

    /// Returns the distance of `value` to the nearer limit; negative if it is violated; NaN if
    /// `value` is NaN.
    pub fn margin(&self, value: f64) -> f64 {
        let above = self.max.map_or(f64::INFINITY, |max| max - value);
        let below = self.min.map_or(f64::INFINITY, |min| value - min);
        // `f64::min` discards a NaN.
        if value.is_nan() {
            f64::NAN
        } else {
            above.min(below)
        }
    }

    /// Returns whether `value` is within the limits; false for NaN.
    pub fn hold(&self, value: f64) -> bool {
        self.margin(value) >= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: Limits = Limits {
        min: Some(1.0),
        max: Some(3.0),
    };

    #[test]
    fn comparison_uses_the_limit_with_the_least_margin() {
        let low = BOTH.compare(1.1, 2.0);
        assert_eq!((low.measured, low.bound), (1.1, 1.0));
        let high = BOTH.compare(2.0, 3.5);
        assert_eq!((high.measured, high.bound, high.margin), (3.5, 3.0, -0.5));
    }

    #[test]
    fn nan_violates_all_limits() {
        assert!(!BOTH.hold(f64::NAN));
        assert!(!Limits::at_most(1.0).hold(f64::NAN));
        for (least, greatest) in [(f64::NAN, 2.0), (2.0, f64::NAN), (f64::NAN, f64::NAN)] {
            let margin = BOTH.compare(least, greatest).margin;
            assert!(margin.is_nan(), "{least} {greatest} {margin}");
        }
    }

    #[test]
    fn limits_that_accept_all_or_no_values_of_a_domain_are_detected() {
        let limits = |min, max| Limits { min, max };
        for (domain, constant, variable) in [
            (
                Domain::SHARE,
                vec![
                    limits(None, Some(1.0)),
                    limits(Some(0.0), Some(5.0)),
                    limits(Some(1.1), None),
                    limits(None, Some(-0.1)),
                ],
                vec![limits(None, Some(0.99)), limits(Some(0.0), Some(0.0))],
            ),
            (
                Domain::POSITIVE,
                vec![limits(Some(0.0), None), limits(None, Some(0.0))],
                vec![limits(None, Some(1e-9)), limits(Some(1e300), None)],
            ),
            (
                Domain::COUNT,
                vec![limits(Some(0.0), None), limits(Some(2.2), Some(2.8))],
                vec![limits(None, Some(0.0)), limits(Some(2.2), Some(3.0))],
            ),
            (
                Domain::HALF_TURN,
                vec![limits(None, Some(180.0 * (PI / 180.0)))],
                vec![limits(None, Some(3.0))],
            ),
        ] {
            let is_constant = |l: &Limits| domain.is_within(l) || domain.is_outside(l);
            assert!(constant.iter().all(is_constant), "{domain:?}");
            assert!(!variable.iter().any(is_constant), "{domain:?}");
        }
        let far = limits(Some(-1e9), Some(1e9));
        assert!(!Domain::ANY.is_within(&far) && !Domain::ANY.is_outside(&far));
    }

    #[test]
    fn limits_are_inclusive() {
        assert!(BOTH.hold(1.0) && BOTH.hold(3.0) && !BOTH.hold(3.000_000_1));
    }
}
