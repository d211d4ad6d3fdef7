//! Confidence interval of a share, after Wilson: *Probable inference, the law of succession, and
//! statistical inference*, Journal of the American Statistical Association 22 (1927).

use serde::Serialize;

/// Confidence interval of a probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShareInterval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl ShareInterval {
    /// Returns the score interval of Wilson, without continuity correction, for `held` of `count`
    /// independent draws: all probabilities that a two-sided test at `1 - confidence` does not
    /// reject. From 0 to 1 without a draw.
    ///
    /// ```
    /// use twinrig_campaign::sweep::ShareInterval;
    ///
    /// // Ten of ten: a probability of 80 % is not excluded.
    /// let ten = ShareInterval::wilson(10, 10, 0.95);
    /// assert_eq!((ten.low * 1e4).round(), 7225.0);
    /// ```
    pub fn wilson(held: usize, count: usize, confidence: f64) -> Self {
        if count == 0 {
            return Self {
                low: 0.0,
                high: 1.0,
            };
        }
        let (held_f, n) = (held as f64, count as f64);
        let z = two_sided_quantile(confidence);
        let share = held_f / n;
        let square = z * z;
        let centre = (held_f + 0.5 * square) / (n + square);
        let spread = (n * share * (1.0 - share) + 0.25 * square).sqrt();
        let half = z * spread / (n + square);
        // The ends are exact where all draws agree; rounding would leave 1e-17.
        Self {
            low: if held == 0 { 0.0 } else { centre - half },
            high: if held == count { 1.0 } else { centre + half },
        }
    }
}

/// Returns z with P(|Z| ≤ z) = `confidence` for a standard normal Z, for a confidence between 0 and
/// 1, exclusive. Newton's method on erfc(z/√2) = 1 − confidence: the function falls and is convex
/// for z ≥ 0, so that the steps from 0 approach the root from below.
fn two_sided_quantile(confidence: f64) -> f64 {
    let outside = 1.0 - confidence;
    let mut z = 0.0;
    for _ in 0..200 {
        let slope = (2.0 / std::f64::consts::PI).sqrt() * libm::exp(-0.5 * z * z);
        let step = (libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2) - outside) / slope;
        z += step;
        if step <= 1e-15 * z {
            break;
        }
    }
    z
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// SciPy 1.17.1: `binomtest(k, n).proportion_ci(c, method='wilson')`.
    #[test]
    fn intervals_are_those_of_scipy() {
        for (held, count, confidence, low, high) in SCIPY {
            let found = ShareInterval::wilson(*held, *count, *confidence);
            assert!((found.low - low).abs() < 1e-14, "{found:?} {low}");
            assert!((found.high - high).abs() < 1e-14, "{found:?} {high}");
        }
    }

    const SCIPY: &[(usize, usize, f64, f64, f64)] = &[
        (10, 10, 0.95, 0.722_467_200_137_110_9, 1.0),
        (
            8,
            10,
            0.95,
            0.490_162_471_536_641_8,
            0.943_317_848_545_624_8,
        ),
        (0, 7, 0.95, 0.0, 0.354_330_435_066_687_43),
        (1, 1, 0.5, 0.687_315_255_917_416_7, 1.0),
        (
            81,
            100,
            0.95,
            0.722_211_546_209_356_2,
            0.874_852_484_902_312_6,
        ),
        (
            170,
            200,
            0.99,
            0.773_798_451_513_007_1,
            0.903_725_056_388_552_9,
        ),
        (
            999,
            1000,
            0.999,
            0.987_388_279_390_775_2,
            0.999_921_558_013_780_5,
        ),
        (
            3,
            2000,
            0.9,
            0.000_599_626_834_786_369,
            0.003_747_264_540_508_291,
        ),
        (
            12_345,
            20_000,
            0.9999,
            0.603_794_323_462_299,
            0.630_528_332_888_845_7,
        ),
    ];

    proptest! {
        /// The definition: at the ends, the score statistic is the quantile.
        #[test]
        fn ends_solve_the_score_equation(
            count in 1_usize..2000, part in any::<prop::sample::Index>(), confidence in 0.5..0.9999_f64,
        ) {
            let held = part.index(count + 1);
            let z = two_sided_quantile(confidence);
            let n = count as f64;
            let share = held as f64 / n;
            let interval = ShareInterval::wilson(held, count, confidence);
            for end in [interval.low, interval.high] {
                let is_limit = (end == 0.0 && held == 0) || (end == 1.0 && held == count);
                let score = (share - end) * (share - end) * n - z * z * end * (1.0 - end);
                prop_assert!(is_limit || score.abs() < 1e-9 * n, "{end}: {score}");
            }
            prop_assert!(interval.low <= share && share <= interval.high);
            // Symmetry of success and failure.
            let other = ShareInterval::wilson(count - held, count, confidence);
            prop_assert!((interval.low - (1.0 - other.high)).abs() < 1e-12);
        }
    }
}
