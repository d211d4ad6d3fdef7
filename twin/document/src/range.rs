//! Intervals of numbers with open or closed ends.

use std::fmt;
use std::ops::Bound;

/// Interval of accepted numbers. Each end is included, excluded or unbounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lower bound.
    pub min: Bound<f64>,
    /// Upper bound.
    pub max: Bound<f64>,
}

impl Range {
    /// Every finite number.
    pub const ANY: Range = Range {
        min: Bound::Unbounded,
        max: Bound::Unbounded,
    };
    /// Greater than zero.
    pub const POSITIVE: Range = Range {
        min: Bound::Excluded(0.0),
        max: Bound::Unbounded,
    };
    /// Zero or greater.
    pub const NOT_NEGATIVE: Range = Range {
        min: Bound::Included(0.0),
        max: Bound::Unbounded,
    };

    /// Greater than zero, up to `max`, which is included.
    pub const fn positive_to(max: f64) -> Self {
        Range {
            min: Bound::Excluded(0.0),
            max: Self::included(max),
        }
    }

    /// The interval from `min` to `max`, both included; an infinite end is unbounded.
    pub const fn between(min: f64, max: f64) -> Self {
        Range {
            min: Self::included(min),
            max: Self::included(max),
        }
    }

    const fn included(value: f64) -> Bound<f64> {
        if value.is_finite() {
            Bound::Included(value)
        } else {
            Bound::Unbounded
        }
    }

    /// Returns the smallest interval that contains this one and `other`.
    ///
    /// ```
    /// use twinrig_document::Range;
    ///
    /// let hull = Range::between(0.0, 1.0).hull(&Range::POSITIVE);
    /// assert_eq!(hull, Range::NOT_NEGATIVE);
    /// ```
    #[must_use]
    pub fn hull(&self, other: &Range) -> Range {
        // `sign` selects the outer bound; of equal bounds the included one is the outer one.
        let outer = |one: Bound<f64>, other: Bound<f64>, sign: f64| match (one, other) {
            (Bound::Unbounded, _) | (_, Bound::Unbounded) => Bound::Unbounded,
            (Bound::Included(a) | Bound::Excluded(a), Bound::Included(b) | Bound::Excluded(b)) => {
                let first = sign * a > sign * b || (a == b && matches!(one, Bound::Included(_)));
                if first { one } else { other }
            }
        };
        Range {
            min: outer(self.min, other.min, -1.0),
            max: outer(self.max, other.max, 1.0),
        }
    }

    /// The interval of the numbers times `factor`, which is positive.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Range {
            min: self.min.map(|value| value * factor),
            max: self.max.map(|value| value * factor),
        }
    }

    /// Whether `value` is in the interval. NaN is in none.
    pub fn contains(&self, value: f64) -> bool {
        let above = match self.min {
            Bound::Included(min) => value >= min,
            Bound::Excluded(min) => value > min,
            Bound::Unbounded => true,
        };
        let below = match self.max {
            Bound::Included(max) => value <= max,
            Bound::Excluded(max) => value < max,
            Bound::Unbounded => true,
        };
        value.is_finite() && above && below
    }

    /// Describes the interval in words, with `symbol` after each number:
    /// `greater than 0 m, at most 0.2 m`.
    pub fn words(&self, symbol: &str) -> String {
        let with = |value: f64| {
            let value = readable(value);
            if symbol.is_empty() || symbol == "1" {
                value
            } else {
                format!("{value} {symbol}")
            }
        };
        let min = match self.min {
            Bound::Included(min) => Some(format!("at least {}", with(min))),
            Bound::Excluded(min) => Some(format!("greater than {}", with(min))),
            Bound::Unbounded => None,
        };
        let max = match self.max {
            Bound::Included(max) => Some(format!("at most {}", with(max))),
            Bound::Excluded(max) => Some(format!("less than {}", with(max))),
            Bound::Unbounded => None,
        };
        match (min, max) {
            (Some(min), Some(max)) => format!("{min}, {max}"),
            (Some(end), None) | (None, Some(end)) => end,
            (None, None) => "any finite number".into(),
        }
    }
}

/// Formats a number with up to nine significant digits: `0.3`, not `0.30000000000000004`; `1e9`,
/// not `1000000000`.
pub(crate) fn readable(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let rounded: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    let magnitude = rounded.abs();
    if (1e-4..1e6).contains(&magnitude) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

impl fmt::Display for Range {
    /// Interval notation of the thesis: `]0; 1[`, `[0; +∞[`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.min {
            Bound::Included(min) => write!(f, "[{min}; ")?,
            Bound::Excluded(min) => write!(f, "]{min}; ")?,
            Bound::Unbounded => write!(f, "]−∞; ")?,
        }
        match self.max {
            Bound::Included(max) => write!(f, "{max}]"),
            Bound::Excluded(max) => write!(f, "{max}["),
            Bound::Unbounded => write!(f, "+∞["),
        }
    }
}
