//! Weights of the method that runs have.

/// Instants of the second and the third stage as shares of a substep, and the weights of the slopes
/// in the states of the stages.
pub(crate) const NODES: [f64; 2] = [0.25, 0.6];
pub(crate) const SECOND: [f64; 1] = [0.25];
pub(crate) const THIRD: [f64; 2] = [-0.24, 0.84];
pub(crate) const FOURTH: [f64; 3] = [6.0 / 5.0, -57.0 / 35.0, 10.0 / 7.0];

/// Weights bⱼ of the slopes.
pub(crate) const MEAN: [f64; 4] = [1.0 / 9.0, 16.0 / 63.0, 125.0 / 252.0, 5.0 / 36.0];

/// Weights eⱼ of the slopes in the error.
pub(crate) const ERROR: [f64; 5] = [
    -1.0 / 18.0,
    8.0 / 63.0,
    -25.0 / 252.0,
    -5.0 / 36.0,
    1.0 / 6.0,
];
