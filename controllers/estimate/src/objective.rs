//! Objective of tuning (eq. 4.19).

/// Weights of the errors in O = exp(−α RMSE(F)² − β RMSE(Ḟ)² − γ RMSE(D − D̄)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective {
    /// Weight α of the force \[1/N²\].
    pub force: f64,
    /// Weight β of its rate \[s²/N²\].
    pub rate: f64,
    /// Weight γ of the bias \[1/V\].
    pub bias: f64,
}

/// Estimate of one instant beside the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunedSample {
    /// Estimated force \[N\], rate \[N/s\] and bias \[V\].
    pub estimate: [f64; 3],
    /// True force \[N\] and rate \[N/s\].
    pub truth: [f64; 2],
}

impl Objective {
    /// The thesis' weights.
    pub const THESIS: Self = Self {
        force: 5.0,
        rate: 1e-2,
        bias: 1e-5,
    };

    /// Returns −ln O, zero at best, of the samples of a run. The thesis maximises O; −ln O orders
    /// the same way and does not underflow: O is zero in doubles from a force error of 12 N.
    ///
    /// The bias counts by its deviation from its mean, unsquared as printed.
    ///
    /// Returns NaN if an estimate is NaN; without samples, zero.
    ///
    /// ```
    /// use twinrig_estimate::{Objective, TunedSample};
    ///
    /// let sample = TunedSample { estimate: [3.0, 0.0, 0.1], truth: [1.0, 10.0] };
    /// assert!((Objective::THESIS.cost(&[sample]) - 21.0).abs() < 1e-12); // 5·2² + 10⁻²·10²
    /// ```
    pub fn cost(&self, samples: &[TunedSample]) -> f64 {
        if samples.is_empty() {
            return 0.0;
        }
        let count = samples.len() as f64;
        let mean_square = |error: &dyn Fn(&TunedSample) -> f64| {
            samples.iter().map(|it| error(it) * error(it)).sum::<f64>() / count
        };
        let mean_bias = samples.iter().map(|it| it.estimate[2]).sum::<f64>() / count;
        let force = mean_square(&|it| it.estimate[0] - it.truth[0]);
        let rate = mean_square(&|it| it.estimate[1] - it.truth[1]);
        let bias = mean_square(&|it| it.estimate[2] - mean_bias);
        self.force * force + self.rate * rate + self.bias * bias.sqrt()
    }
}
