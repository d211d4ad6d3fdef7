//! Identification of both cells from recorded forces and voltages.

mod amplifier;
mod coefficients;
mod creep;
mod hysteresis;
mod least_squares;

pub use amplifier::{AmplifierFit, amplifier};
pub use coefficients::{CoefficientFit, RateSample, Run, coefficients};
pub use creep::{CreepFit, creep};
pub use hysteresis::{ForceSample, guess_hysteresis, hysteresis};

/// Result of an identification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted<T> {
    /// The parameters.
    pub model: T,
    /// Coefficient of determination R².
    pub r_squared: f64,
    /// Root of the mean square of the residuals \[V\].
    pub residual: f64,
    /// Iterations used.
    pub iterations: usize,
}
