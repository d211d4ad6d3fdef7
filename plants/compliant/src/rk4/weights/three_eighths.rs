//! Kutta's rule of three eighths, a peer of the method: other stages, other weights, another
//! estimate of the error, and nothing exponential. Programs of the feature `three-eighths` have it,
//! for runs that errors of the method are compared with.

/// Instants of the second and the third stage, and the weights of the slopes in the states of the
/// stages.
pub(crate) const NODES: [f64; 2] = [1.0 / 3.0, 2.0 / 3.0];
pub(crate) const SECOND: [f64; 1] = [1.0 / 3.0];
pub(crate) const THIRD: [f64; 2] = [-1.0 / 3.0, 1.0];
pub(crate) const FOURTH: [f64; 3] = [1.0, -1.0, 1.0];

/// Weights of the slopes.
pub(crate) const MEAN: [f64; 4] = [1.0 / 8.0, 3.0 / 8.0, 3.0 / 8.0, 1.0 / 8.0];

/// Weights of the slopes in the error: those of order 3 are one-parametric, and the last is that of
/// the own method.
pub(crate) const ERROR: [f64; 5] = [-1.0 / 24.0, 1.0 / 8.0, -1.0 / 8.0, -1.0 / 8.0, 1.0 / 6.0];
