//! What a measured value must not exceed.

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

    /// Reads a table of its own: `{ min = …, max = … }` or `{ near = …, within = … }`.
    pub(crate) fn read(item: &Item<'_>, unit: Unit) -> Result<Self, Reported> {
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
        Self::read_from(&table, unit, &|message, help| item.report(message, help))
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
    fn a_limit_itself_is_accepted() {
        assert!(BOTH.hold(1.0) && BOTH.hold(3.0) && !BOTH.hold(3.000_000_1));
    }
}
