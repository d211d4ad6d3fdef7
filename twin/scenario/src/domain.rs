//! Domain of a measure: its possible values.

use std::f64::consts::PI;
use std::ops::Bound;

use twinrig_document::Range;
use twinrig_kernel::Unit;

use crate::gait::Fitness;
use crate::limits::Limits;

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
