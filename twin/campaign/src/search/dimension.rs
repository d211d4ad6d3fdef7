//! Ranges of the parameters of a search.

use serde::{Deserialize, Serialize};

use super::SearchError;

/// Range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dimension {
    /// Lower bound, in the parameter's unit.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Whether the logarithm of the parameter is searched: for ranges of several decades.
    pub logarithmic: bool,
}

impl Dimension {
    /// Returns a range in which all differences of the same size count the same.
    pub const fn linear(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: false,
        }
    }

    /// Returns a range in which all ratios of the same size count the same; both bounds are
    /// positive.
    pub const fn logarithmic(low: f64, high: f64) -> Self {
        Self {
            low,
            high,
            logarithmic: true,
        }
    }

    /// Parameter at a share of the range, 0 to 1; the bounds are met exactly.
    pub(super) fn at(&self, share: f64) -> f64 {
        let between = |low: f64, high: f64| low * (1.0 - share) + high * share;
        let value = if self.logarithmic {
            libm::exp(between(libm::log(self.low), libm::log(self.high)))
        } else {
            between(self.low, self.high)
        };
        if share <= 0.0 {
            self.low
        } else if share >= 1.0 {
            self.high
        } else {
            value.clamp(self.low, self.high)
        }
    }

    fn check(&self, index: usize) -> Result<(), SearchError> {
        let finite = self.low.is_finite() && self.high.is_finite();
        let positive = !self.logarithmic || self.low > 0.0;
        if finite && positive && self.low < self.high {
            return Ok(());
        }
        Err(SearchError::Bounds {
            index,
            low: self.low,
            high: self.high,
            required: if self.logarithmic {
                "finite, positive and in ascending order"
            } else {
                "finite and in ascending order"
            },
        })
    }
}

/// Returns the parameters at shares of their ranges.
pub(super) fn parameters(dimensions: &[Dimension], shares: &[f64]) -> Vec<f64> {
    let pairs = dimensions.iter().zip(shares);
    pairs
        .map(|(dimension, &share)| dimension.at(share))
        .collect()
}

/// Checks the ranges, and numbers that have to be positive.
pub(super) fn check(
    dimensions: &[Dimension],
    counts: &[(&'static str, usize)],
) -> Result<(), SearchError> {
    if dimensions.is_empty() {
        return Err(SearchError::NoDimensions);
    }
    for (what, count) in counts {
        if *count == 0 {
            return Err(SearchError::Zero { what });
        }
    }
    let mut dimensions = dimensions.iter().enumerate();
    dimensions.try_for_each(|(index, dimension)| dimension.check(index))
}
