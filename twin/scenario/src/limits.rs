//! What a measured value must not exceed.

use std::f64::consts::PI;
use std::ops::Bound;

use twinrig_document::{Item, Range, Reported, Table, print_quantity};
use twinrig_kernel::Unit;

/// Least and greatest accepted value. At least one of them is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Least accepted value, itself accepted.
    pub min: Option<f64>,
    /// Greatest accepted value, itself accepted.
    pub max: Option<f64>,
}

/// The values that a measure can take, whatever the run does. Limits that all of them or none of
/// them are within would be a verdict without a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Domain {
    range: Range,
    whole: bool,
}

impl Domain {
    pub const ANY: Domain = Domain::of(Range::ANY);
    pub const POSITIVE: Domain = Domain::of(Range::POSITIVE);
    pub const NOT_NEGATIVE: Domain = Domain::of(Range::NOT_NEGATIVE);
    /// 0, 1, 2, …
    pub const COUNT: Domain = Domain {
        range: Range::NOT_NEGATIVE,
        whole: true,
    };
    /// A share.
    pub const SHARE: Domain = Domain::up_to(1.0);
    /// The magnitude of a roll; peak to peak, a pitch.
    pub const HALF_TURN: Domain = Domain::up_to(PI);
    /// The magnitude of a pitch, which lies between nose up and nose down.
    pub const QUARTER_TURN: Domain = Domain::up_to(PI / 2.0);
    /// Peak to peak, a roll.
    pub const TURN: Domain = Domain::up_to(2.0 * PI);

    const fn of(range: Range) -> Self {
        Domain {
            range,
            whole: false,
        }
    }

    const fn up_to(max: f64) -> Self {
        Domain::of(Range {
            min: Bound::Included(0.0),
            max: Bound::Included(max),
        })
    }

    /// Whether every value is within `limits`.
    fn is_within(&self, limits: &Limits) -> bool {
        // Degrees become radians with an error in the last place.
        const NEARLY: f64 = 1.0 - 1e-12;
        let above = match (limits.min, self.range.min) {
            (None, _) => true,
            (Some(min), Bound::Included(least) | Bound::Excluded(least)) => min <= least,
            (Some(_), Bound::Unbounded) => false,
        };
        let below = match (limits.max, self.range.max) {
            (None, _) => true,
            (Some(max), Bound::Included(most) | Bound::Excluded(most)) => max >= most * NEARLY,
            (Some(_), Bound::Unbounded) => false,
        };
        above && below
    }

    /// Whether no value is within `limits`.
    fn is_outside(&self, limits: &Limits) -> bool {
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
            (Some(min), Some(max)) => self.whole && max.floor() < min.ceil(),
            _ => false,
        };
        below || above || between
    }

    fn words(&self, unit: Unit) -> String {
        let whole = if self.whole { "a whole number, " } else { "" };
        format!("{whole}{}", self.range.words(unit.symbol()))
    }
}

/// How values compare with [`Limits`]: the value that is nearest to violating them, the limit that it is nearest to, and the
/// distance, negative if it is violated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The value.
    pub measured: f64,
    /// The limit.
    pub bound: f64,
    /// Distance to the limit; negative on its wrong side; NaN if the value is.
    pub margin: f64,
    /// The limit on the other side, if there is one.
    pub other: Option<f64>,
}

impl Limits {
    /// No more than `max`.
    pub const fn at_most(max: f64) -> Self {
        Limits {
            min: None,
            max: Some(max),
        }
    }

    /// Compares values that lie between `least` and `greatest`.
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
            // A NaN on either side is what is shown.
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

    /// How far `value` is inside; negative outside; NaN if it is.
    pub fn margin(&self, value: f64) -> f64 {
        let above = self.max.map_or(f64::INFINITY, |max| max - value);
        let below = self.min.map_or(f64::INFINITY, |min| value - min);
        // `f64::min` would prefer the number to the NaN.
        if value.is_nan() {
            f64::NAN
        } else {
            above.min(below)
        }
    }

    /// Whether `value` is inside. NaN is not.
    pub fn hold(&self, value: f64) -> bool {
        self.margin(value) >= 0.0
    }

    /// Reads a table of its own: `{ min = …, max = … }` or `{ near = …, within = … }`, for a
    /// measure that takes the values of `domain`.
    pub(crate) fn read(item: &Item<'_>, unit: Unit, domain: &Domain) -> Result<Self, Reported> {
        if !item.is_table() {
            let example = if unit == Unit::One {
                "0.5".to_owned()
            } else {
                format!("\"{}\"", print_quantity(0.5, unit))
            };
            let message = format!("`{}` wants limits", item.key());
            let help = format!(
                "write {{ max = {example} }}, {{ min = …, max = … }} or {{ near = …, within = … }}"
            );
            return Err(item.report(message, help));
        }
        let table = item.table()?;
        let limits = Self::read_from(&table, unit, &|message, help| item.report(message, help))?;
        let key = item.key();
        let message = if domain.is_within(&limits) {
            format!("no value of `{key}` violates these limits")
        } else if domain.is_outside(&limits) {
            format!("no value of `{key}` is within these limits")
        } else {
            return Ok(limits);
        };
        let help = format!("`{key}` is always {}", domain.words(unit));
        Err(item.report(message, help))
    }

    /// Reads `min`, `max`, `near` and `within` out of a table that may hold other keys too.
    pub(crate) fn read_from(
        table: &Table<'_>,
        unit: Unit,
        report: &dyn Fn(&str, &str) -> Reported,
    ) -> Result<Self, Reported> {
        let quantity = |key: &str| table.optional(key, |item| item.quantity(unit, &Range::ANY));
        let (min, max, near) = (quantity("min"), quantity("max"), quantity("near"));
        let centre = near.as_ref().map_or(0.0, |near| near.unwrap_or(0.0));
        let within = table.optional("within", |item| within(item, unit, centre));
        let (min, max, near, within) = (min?, max?, near?, within?);
        match (min, max, near, within) {
            (None, None, Some(near), Some(within)) => Ok(Limits {
                min: Some(near - within),
                max: Some(near + within),
            }),
            (Some(min), Some(max), None, None) if min > max => Err(report(
                "`min` is greater than `max`",
                "nothing lies between them",
            )),
            (None, None, None, None) => Err(report(
                "there is no limit",
                "give `min`, `max` or both, or `near` and `within`",
            )),
            (min, max, None, None) => Ok(Limits { min, max }),
            _ => Err(report(
                "these limits do not go together",
                "give `min`, `max` or both, or `near` and `within`",
            )),
        }
    }
}

/// A distance from `centre`: a quantity, or a percentage of it.
fn within(item: &Item<'_>, unit: Unit, centre: f64) -> Result<f64, Reported> {
    if item.is_text() && item.text()?.trim_end().ends_with('%') {
        let share = item.number(&Range::NOT_NEGATIVE)?;
        return Ok(share * centre.abs());
    }
    item.quantity(unit, &Range::NOT_NEGATIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: Limits = Limits {
        min: Some(1.0),
        max: Some(3.0),
    };

    #[test]
    fn the_nearer_limit_is_the_one_that_counts() {
        let low = BOTH.compare(1.1, 2.0);
        assert_eq!((low.measured, low.bound), (1.1, 1.0));
        let high = BOTH.compare(2.0, 3.5);
        assert_eq!((high.measured, high.bound, high.margin), (3.5, 3.0, -0.5));
    }

    #[test]
    fn nan_is_within_no_limits() {
        assert!(!BOTH.hold(f64::NAN));
        assert!(!Limits::at_most(1.0).hold(f64::NAN));
        for (least, greatest) in [(f64::NAN, 2.0), (2.0, f64::NAN), (f64::NAN, f64::NAN)] {
            let margin = BOTH.compare(least, greatest).margin;
            assert!(margin.is_nan(), "{least} {greatest} {margin}");
        }
    }

    #[test]
    fn limits_divide_the_values_that_there_are() {
        let limits = |min, max| Limits { min, max };
        for (domain, decided, undecided) in [
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
            let decides = |l: &Limits| domain.is_within(l) || domain.is_outside(l);
            assert!(decided.iter().all(decides), "{domain:?}");
            assert!(!undecided.iter().any(decides), "{domain:?}");
        }
        let far = limits(Some(-1e9), Some(1e9));
        assert!(!Domain::ANY.is_within(&far) && !Domain::ANY.is_outside(&far));
    }

    #[test]
    fn a_limit_itself_is_accepted() {
        assert!(BOTH.hold(1.0) && BOTH.hold(3.0) && !BOTH.hold(3.000_000_1));
    }
}
