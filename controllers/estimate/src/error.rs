//! Errors of estimators.

use thiserror::Error;

/// Reason why a filter, its configuration or an identification is invalid.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// A variance is negative, infinite or NaN, or zero where noise is required.
    #[error("the variance of {entry} is {value}; it has to be finite and {required}")]
    Variance {
        /// Name of the entry.
        entry: &'static str,
        /// Its value, in squared units of the entry.
        value: f64,
        /// `positive`, or `zero or more`.
        required: &'static str,
    },
    /// A number is not finite or outside its domain.
    #[error("{entry} is {value}; it has to be {required}")]
    Value {
        /// Name of the entry.
        entry: &'static str,
        /// Its value (SI).
        value: f64,
        /// The domain.
        required: &'static str,
    },
    /// Model `F2` without a measured frequency.
    #[error("model F2 requires a measured frequency: set its variance, or use F1 or F3")]
    NoFrequency,
    /// No sensor of force is configured.
    #[error("there is no sensor: set the piezoresistive cell, the piezoelectric cell, or both")]
    NoSensor,
    /// The covariance of the compared states is not positive definite.
    #[error("the covariance of the first {count} states is not positive definite")]
    SingularCovariance {
        /// Number of compared states.
        count: usize,
    },
    /// A number of values that does not match.
    #[error("{entry}: {found} values, {required}")]
    Length {
        /// Name of the entry.
        entry: &'static str,
        /// Number of values.
        found: usize,
        /// Required number.
        required: String,
    },
    /// An identification did not converge.
    #[error("the fit of {what} did not converge within {iterations} iterations (R² {r_squared})")]
    NoConvergence {
        /// Name of the model.
        what: &'static str,
        /// Number of iterations.
        iterations: usize,
        /// Coefficient of determination at the end.
        r_squared: f64,
    },
    /// The data do not determine the parameters.
    #[error("the data do not determine the parameters of {what}")]
    Undetermined {
        /// Name of the model.
        what: &'static str,
    },
}

/// Rejects what is not a variance; `positive` rejects zero, too.
pub(crate) fn variance(
    entry: &'static str,
    value: f64,
    positive: bool,
) -> Result<(), EstimateError> {
    let valid = value.is_finite() && if positive { value > 0.0 } else { value >= 0.0 };
    if valid {
        return Ok(());
    }
    Err(EstimateError::Variance {
        entry,
        value,
        required: if positive { "positive" } else { "zero or more" },
    })
}

/// Rejects values that are not finite.
pub(crate) fn finite(entry: &'static str, value: f64) -> Result<(), EstimateError> {
    require(entry, value, value.is_finite(), "finite")
}

/// Rejects values that are not finite and positive.
pub(crate) fn positive(entry: &'static str, value: f64) -> Result<(), EstimateError> {
    let valid = value.is_finite() && value > 0.0;
    require(entry, value, valid, "finite and positive")
}

pub(crate) fn require(
    entry: &'static str,
    value: f64,
    valid: bool,
    required: &'static str,
) -> Result<(), EstimateError> {
    if valid {
        return Ok(());
    }
    Err(EstimateError::Value {
        entry,
        value,
        required,
    })
}
