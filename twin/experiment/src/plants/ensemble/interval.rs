//! Confidence interval of a mean, by Student's t distribution. Libraries of distributions use the
//! logarithms of the platform; this is of `libm`.

use serde::{Deserialize, Serialize};

/// Probability that the interval contains the mean of the population.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// Mean of a sample with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Standard deviation of the sample.
    pub deviation: f64,
}

impl Interval {
    /// Returns the interval of the mean of independent, normally distributed `values`; `None` for
    /// fewer than two.
    pub(crate) fn of(values: &[f64]) -> Option<Self> {
        if values.len() < 2 {
            return None;
        }
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|value| (value - mean) * (value - mean));
        let deviation = (squares.sum::<f64>() / (count - 1.0)).sqrt();
        let half = quantile(0.5 * (1.0 + CONFIDENCE), count - 1.0) * deviation / count.sqrt();
        Some(Self {
            mean,
            low: mean - half,
            high: mean + half,
            deviation,
        })
    }

    /// Returns whether the intervals have a point in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.low <= other.high && other.low <= self.high
    }
}

/// Returns the quantile of Student's t distribution for a probability above one half, by bisection.
pub(crate) fn quantile(probability: f64, degrees: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while cumulative(high, degrees) < probability {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if cumulative(middle, degrees) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Returns the probability of values below `t` ≥ 0: `1 − I_x(ν/2, ½)/2` with x = ν/(ν + t²).
fn cumulative(t: f64, degrees: f64) -> f64 {
    1.0 - 0.5 * incomplete_beta(degrees / (degrees + t * t), 0.5 * degrees, 0.5)
}

/// Regularised incomplete beta function `I_x(a, b)`, by its continued fraction (DLMF 8.17.22) where
/// that converges fast, elsewhere by `I_x(a, b) = 1 − I_{1−x}(b, a)`.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let beta = libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    let front = libm::exp(a * libm::log(x) + b * libm::log1p(-x) - beta) / a;
    front / fraction(x, a, b)
}

/// Returns 1 + d₁/(1 + d₂/(1 + …)), from its last term to its first.
fn fraction(x: f64, a: f64, b: f64) -> f64 {
    const TERMS: u32 = 200;
    let mut value = 1.0;
    for n in (1..=TERMS).rev() {
        let m = f64::from(n / 2);
        let term = if n.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        value = 1.0 + term / value;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `scipy.stats.t.ppf(0.975, degrees)` of `SciPy` 1.17.1.
    #[test]
    fn quantiles_are_those_of_scipy() {
        let quantiles = [
            (1.0, 12.706_204_736_174_694),
            (2.0, 4.302_652_729_749_462),
            (5.0, 2.570_581_835_636_314_6),
            (9.0, 2.262_157_162_798_205),
            (30.0, 2.042_272_456_301_237_8),
            (99.0, 1.984_216_951_586_417_4),
            (999.0, 1.962_341_461_133_449_3),
        ];
        for (degrees, expected) in quantiles {
            let found = quantile(0.975, degrees);
            assert!((found / expected - 1.0).abs() < 1e-11, "{degrees}: {found}");
        }
    }

    /// `scipy.stats.t.interval(0.95, len(x) - 1, numpy.mean(x), scipy.stats.sem(x))`.
    #[test]
    fn interval_is_that_of_scipy() {
        let values = [0.951, 0.957, 0.949, 0.962, 0.955, 0.958];
        let found = Interval::of(&values).unwrap();
        let [mean, low, high, deviation] = [
            0.955_333_333_333_333_4,
            0.950_337_020_324_880_5,
            0.960_329_646_341_786_2,
            0.004_760_952_285_695_237,
        ];
        for (found, expected) in [
            (found.mean, mean),
            (found.low, low),
            (found.high, high),
            (found.deviation, deviation),
        ] {
            assert!((found - expected).abs() < 1e-12, "{found}: {expected}");
        }
        assert_eq!(Interval::of(&values[..1]), None);
    }

    #[test]
    fn intervals_overlap_if_they_share_a_point() {
        let of = |low, high| Interval {
            mean: 0.5 * (low + high),
            low,
            high,
            deviation: 1.0,
        };
        assert!(of(0.0, 1.0).overlaps(&of(1.0, 2.0)) && of(0.0, 3.0).overlaps(&of(1.0, 2.0)));
        assert!(!of(0.0, 1.0).overlaps(&of(1.1, 2.0)) && !of(1.1, 2.0).overlaps(&of(0.0, 1.0)));
    }
}
