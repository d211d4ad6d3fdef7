//! Numerical error of a measured value.

use serde::Serialize;

/// Numerical error of a measured value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorBar {
    /// The error, in the unit of the measured value; none of a count, and of a value that is not
    /// observed in every run.
    pub error: Option<f64>,
    /// Source of the error; none without one.
    pub error_by: Option<ErrorSource>,
    /// Whether the verdict is the same within the error.
    pub decided: bool,
}

/// Source of a numerical error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ErrorSource {
    /// Bound of the error, by runs at finer settings.
    Refinement,
    /// Deviation of runs from other starts: the value is not predictable.
    Ensemble,
}
