//! Distribution of residuals (figure 4.14).

use serde::Serialize;

/// Number of bins of a histogram, over [`SPAN`] standard deviations to either side.
const BINS: usize = 48;
const SPAN: f64 = 4.0;
/// Skewness and excess kurtosis beyond which a distribution counts as not Gaussian. ASSUMED: rules
/// of thumb, as residuals of a periodic signal are not independent, which a test would require.
const SKEWED: f64 = 0.5;
const PEAKED: f64 = 1.0;

/// Residuals of an identification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Residuals {
    /// Identified quantity.
    pub of: &'static str,
    /// Mean \[V\].
    pub mean: f64,
    /// Standard deviation \[V\].
    pub deviation: f64,
    /// Skewness \[1\]; zero for a Gaussian distribution.
    pub skewness: f64,
    /// Kurtosis less 3 \[1\]; zero for a Gaussian distribution.
    pub excess_kurtosis: f64,
    /// Density \[1/V\] of bins of equal width, with the centre of each \[V\]. Residuals beyond the
    /// outer bins are counted in them.
    pub histogram: Vec<[f64; 2]>,
}

impl Residuals {
    /// Computes moments and histogram of values \[V\].
    pub(crate) fn new(of: &'static str, values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let (mut second, mut third, mut fourth) = (0.0, 0.0, 0.0);
        for value in values {
            let d = value - mean;
            let square = d * d;
            second += square / count;
            third += square * d / count;
            fourth += square * square / count;
        }
        let deviation = second.sqrt();
        let scaled = |moment: f64, scale: f64| if scale > 0.0 { moment / scale } else { 0.0 };
        let width = 2.0 * SPAN * deviation / BINS as f64;
        let mut counts = [0.0; BINS];
        for value in values {
            let place = (value - mean + SPAN * deviation) / width;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "clamped to the bins; NaN counts in the first"
            )]
            let bin = place.clamp(0.0, (BINS - 1) as f64) as usize;
            counts[bin] += 1.0;
        }
        let centre = |bin: usize| mean + ((bin as f64 + 0.5) * width - SPAN * deviation);
        let density = |bin: usize| scaled(counts[bin], count * width);
        Self {
            of,
            mean,
            deviation,
            skewness: scaled(third, second * deviation),
            excess_kurtosis: scaled(fourth, second * second) - 3.0,
            histogram: (0..BINS).map(|bin| [centre(bin), density(bin)]).collect(),
        }
    }

    /// Returns the departure from a Gaussian distribution: the greater of skewness and excess
    /// kurtosis, each over the magnitude beyond which a distribution does not count as Gaussian.
    pub fn departure(&self) -> f64 {
        let skewness = self.skewness.abs() / SKEWED;
        skewness.max(self.excess_kurtosis.abs() / PEAKED)
    }

    /// Returns whether skewness and kurtosis are near those of a Gaussian distribution.
    pub fn is_gaussian(&self) -> bool {
        self.departure() <= 1.0
    }
}
