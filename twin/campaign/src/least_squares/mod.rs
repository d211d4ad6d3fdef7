//! Nonlinear least squares within bounds, by Levenberg's and Marquardt's method, and what the data
//! tell about the parameters: covariance, intervals, correlations, directions that they cannot
//! tell.
//!
//! Parameters are shares of their ranges, from 0 to 1, so that their units have no influence. The
//! Jacobian is made of central differences, each of whose steps is the one of several that agrees
//! best with half of it: too long a step has an error of truncation, too short a one shows the
//! noise of a model with events or counts. Sums are formed in a fixed order: results depend neither
//! on threads nor on the processor.

mod jacobian;
mod matrix;
mod problem;
mod profile;
mod solve;
mod statistics;
#[cfg(test)]
mod tests;

pub use jacobian::Jacobian;
pub use problem::{Failure, LeastSquares, Loss, Residuals};
pub use profile::ProfileInterval;
pub use solve::{Descent, Minimum, Step};
pub use statistics::{Direction, Information, integrated_time};
