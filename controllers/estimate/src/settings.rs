//! Configuration of an estimator.

use serde::{Deserialize, Serialize};

use crate::error::{EstimateError, positive, variance};
use crate::model::Model;
use crate::response::ForceResponse;

/// Piezoresistive cell as a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piezoresistive {
    /// Response of the cell with its amplifier.
    pub response: ForceResponse,
    /// Variance of its noise \[V²\].
    pub variance: f64,
}

/// Configuration of a [`ForceEstimator`](crate::ForceEstimator).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Process model and response of the piezoelectric cell.
    pub model: Model,
    /// Piezoresistive cell; `None` ignores its measurements.
    pub piezoresistive: Option<Piezoresistive>,
    /// Variance of the piezoelectric noise \[V²\]; `None` ignores its measurements.
    pub piezoelectric: Option<f64>,
    /// Variance of the measured angular frequency \[rad²/s²\], which model F2 requires and the
    /// others do not use.
    pub frequency: Option<f64>,
    /// Period to which the process variances refer \[s\]. A step of another length adds them in
    /// proportion to it.
    pub period_s: f64,
    /// Density of white noise on the derivative of the highest derivative of the force: of F̈ in F1
    /// \[N²/s³\], of the jerk in F2, F3 and F4 \[N²/s⁵\]. It is added to the process variances, and
    /// does not depend on the lengths of the steps.
    pub white: f64,
    /// Normalised innovation squared of the piezoresistive cell above which its response is
    /// linearised at the measured voltage, not at the estimate. Without it a filter whose estimate
    /// is far in saturation, where the gradient is zero, does not return: `None` is the thesis'
    /// filter. See [`RECOVERY`].
    pub recovery: Option<f64>,
}

/// Usual threshold of [`Settings::recovery`]: five standard deviations. ASSUMED.
pub const RECOVERY: f64 = 25.0;

impl Settings {
    /// Checks all entries.
    ///
    /// # Errors
    /// [`EstimateError`] with the name of the first invalid entry.
    pub fn check(&self) -> Result<(), EstimateError> {
        self.model.check()?;
        if let Some(cell) = &self.piezoresistive {
            cell.response.check()?;
            variance("the piezoresistive cell", cell.variance, true)?;
        }
        if let Some(value) = self.piezoelectric {
            variance("the piezoelectric cell", value, true)?;
        }
        if let Some(value) = self.frequency {
            variance("the measured frequency", value, true)?;
        }
        positive("period of the process variances", self.period_s)?;
        variance("the white noise of the process", self.white, false)?;
        if let Some(threshold) = self.recovery {
            positive("threshold of the recovery", threshold)?;
        }
        if self.piezoresistive.is_none() && self.piezoelectric.is_none() {
            return Err(EstimateError::NoSensor);
        }
        if matches!(self.model, Model::F2 { .. }) && self.frequency.is_none() {
            return Err(EstimateError::NoFrequency);
        }
        Ok(())
    }
}
