//! Weights of the method.
//!
//! It has stages at the begin, a quarter, three fifths and the end of a substep. The slope at its
//! end is the first of the next; with it the estimate of the error is that of a solution of order
//! 3:
//!
//! ```text
//! y₁ = y₀ + h Σ bⱼ kⱼ (j = 1 … 4)    k₅ = f(y₁)    ŷ₁ − y₁ = h Σ eⱼ kⱼ (j = 1 … 5)
//! ```
//!
//! The classical stages see only the middle and the end of a substep, and the difference of two
//! slopes at its end is their estimate: of a foot that lands in the second half it notices nothing.
//! With unequal stages gaits need a sixth less evaluations for the same error of the trunk, and a
//! third less for the same residual of the energy; pairs of order 3 and 5 need more.

/// Instants of the second and the third stage as shares of a substep, and the weights of the slopes
/// in the states of the stages.
pub(super) const NODES: [f64; 2] = [0.25, 0.6];
pub(super) const SECOND: [f64; 1] = [0.25];
pub(super) const THIRD: [f64; 2] = [-0.24, 0.84];
pub(super) const FOURTH: [f64; 3] = [6.0 / 5.0, -57.0 / 35.0, 10.0 / 7.0];

/// Weights bⱼ of the slopes.
pub(super) const MEAN: [f64; 4] = [1.0 / 9.0, 16.0 / 63.0, 125.0 / 252.0, 5.0 / 36.0];

/// Weights eⱼ of the slopes in the error.
pub(super) const ERROR: [f64; 5] = [
    -1.0 / 18.0,
    8.0 / 63.0,
    -25.0 / 252.0,
    -5.0 / 36.0,
    1.0 / 6.0,
];

/// Returns weights times a length of time.
#[inline(always)]
pub(super) fn times<const M: usize>(weights: [f64; M], seconds: f64) -> [f64; M] {
    let mut all = weights;
    for weight in &mut all {
        *weight *= seconds;
    }
    all
}

#[cfg(test)]
mod tests;
