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
//!
//! # What longer substeps would cost
//!
//! In stance and in swing, legs of Cheetah-cub have motions with rates of −560 ± 1370i 1/s, between
//! both −4000 1/s: the method is stable in substeps of 1.9 ms and of 0.7 ms. Evaluations in a
//! millisecond and residual of the energy for errors of 20 µm, over two seconds of trot, walk and
//! obstacle on both plants, by methods that take the 2 ms between two commands at once where the
//! error permits:
//!
//! | method | evaluations | residual |
//! |---|---|---|
//! | this, substeps up to 1 ms | 5.5 | 2e-6 |
//! | this, up to 2 ms | 5.7 | 2e-6 |
//! | this, touch-downs located exactly, at no cost | 5.4 | 3e-6 |
//! | five stages, order 4, stable up to 2 ms | 5.6 | 3e-5 |
//! | seven stages, order 4, stable up to −14/h | 6.8 | 2e-5 |
//! | Dormand and Prince, touch-downs located likewise | 7.9 | 7e-5 |
//! | Bogacki and Shampine | 7.1 | 2e-5 |
//!
//! What costs is the motion after a touch-down, with its kinks where the damper and the bristle
//! engage: it has a quarter of the time and half of the evaluations, whatever the order.

// Tests check the weights of both.
#[cfg(any(test, not(feature = "three-eighths")))]
mod own;
#[cfg(any(test, feature = "three-eighths"))]
mod three_eighths;

#[cfg(not(feature = "three-eighths"))]
pub(super) use own::{ERROR, FOURTH, MEAN, NODES, SECOND, THIRD};
#[cfg(feature = "three-eighths")]
pub(super) use three_eighths::{ERROR, FOURTH, MEAN, NODES, SECOND, THIRD};

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
