//! Measured value of a comparison, or the reason for which it is unobserved.

/// Reason for which no pair was observed.
pub(super) const NOTHING: &str = "there is no observation of both signals in its window";

/// Measured value and a detail, or the reason for which it is unobserved.
pub(super) type Found = Result<(f64, String), String>;
