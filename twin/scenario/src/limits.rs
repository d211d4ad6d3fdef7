//! Limits of a measured value.

/// Least and greatest accepted value, at least one of which is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Least accepted value, inclusive.
    pub min: Option<f64>,
    /// Greatest accepted value, inclusive.
    pub max: Option<f64>,
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
    fn limits_are_inclusive() {
        assert!(BOTH.hold(1.0) && BOTH.hold(3.0) && !BOTH.hold(3.000_000_1));
    }
}
