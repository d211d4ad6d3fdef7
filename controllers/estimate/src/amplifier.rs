//! Charge amplifier behind the elastic layers of the piezoelectric cell, in discrete time.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use crate::error::{EstimateError, finite, positive};

/// Piezoelectric cell with its charge amplifier: V/F = −k s / ((1 + s T₁)(1 + s T₂)).
///
/// As states, with the crystal's rate U \[N/s\]: T₂ U̇ = Ḟ − U, T₁ V̇ = −k U − V. Both poles differ
/// from those of the force, so two states are the least number; the form holds for T₁ = T₂, too.
///
/// At low frequencies V ≈ −k Ḟ + k (T₁ + T₂) F̈: a rate sensor with a coefficient of acceleration
/// of the opposite sign.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChargeAmplifier {
    /// Sensitivity k to the rate \[V·s/N\].
    pub sensitivity: f64,
    /// Time constant T₁ of the amplifier's feedback \[s\].
    pub feedback_s: f64,
    /// Time constant T₂ of the elastic layers \[s\].
    pub lag_s: f64,
}

/// Force, rate, acceleration, rate in the crystal, voltage.
type Chain = SMatrix<f64, 5, 5>;

/// Greatest step over the smaller time constant for which the series are used; longer steps are
/// doubled from shorter ones.
const SERIES: f64 = 0.25;
/// Terms of the series. That of V over F̈ begins with the third power; the first one missing is
/// 2·10⁻¹⁵ of it.
const TERMS: usize = 14;
/// 1/(n + 1), the factors between successive terms.
const INVERSES: [f64; TERMS] = {
    let mut inverses = [1.0; TERMS];
    let mut n = 1;
    while n < TERMS {
        inverses[n] = 1.0 / (n + 1) as f64;
        n += 1;
    }
    inverses
};

/// Nodes and weights of the Gauss–Legendre rule on \[0, 1\] of degree 9.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_45),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

impl ChargeAmplifier {
    /// Returns the transition over `seconds` of (F, Ḟ, F̈, U, V), and the covariance that white
    /// noise of unit density on the derivative of F̈ adds to it. Both are those of the continuous
    /// model: exact but for rounding.
    ///
    /// ```
    /// use twinrig_estimate::ChargeAmplifier;
    ///
    /// let cell = ChargeAmplifier { sensitivity: 0.05, feedback_s: 0.1, lag_s: 0.005 };
    /// let (transition, _) = cell.transition(1e-3);
    /// let decay = transition[(4, 4)];
    /// assert!((decay - 0.990_049_833_749_168).abs() < 1e-15); // exp(−1 ms / 100 ms)
    /// ```
    pub fn transition(&self, seconds: f64) -> (SMatrix<f64, 5, 5>, SMatrix<f64, 5, 5>) {
        let fastest = self.feedback_s.min(self.lag_s);
        let (mut step, mut doublings) = (seconds, 0);
        while step > SERIES * fastest {
            step *= 0.5;
            doublings += 1;
        }
        let (mut transition, mut noise) = self.series(step);
        for _ in 0..doublings {
            noise += transition * noise * transition.transpose();
            transition *= transition;
        }
        (transition, noise)
    }

    /// Transition and noise of a step that is short against both time constants.
    fn series(&self, step: f64) -> (Chain, Chain) {
        let by_acceleration = self.column(step, [0.0, 1.0, 0.0]);
        let by_rate = self.column(step, [1.0, 0.0, 0.0]);
        let by_crystal = self.column(step, [0.0, 0.0, 1.0]);
        let mut transition = Chain::identity();
        transition[(0, 1)] = step;
        transition[(0, 2)] = 0.5 * step * step;
        transition[(1, 2)] = step;
        let columns = [&by_rate, &by_acceleration, &by_crystal];
        for (column, terms) in columns.into_iter().enumerate() {
            let sum = terms
                .iter()
                .rev()
                .fold([0.0; 2], |[u, v], term| [u + term[0], v + term[1]]);
            transition[(3, 1 + column)] = sum[0];
            transition[(4, 1 + column)] = sum[1];
        }
        transition[(4, 4)] = libm::exp(-step / self.feedback_s);
        (transition, noise(step, &by_acceleration))
    }

    /// Terms of the Taylor series of (U, V) over `step` from a start (Ḟ, F̈, U).
    fn column(&self, step: f64, start: [f64; 3]) -> [[f64; 2]; TERMS] {
        let (lag, feedback) = (step / self.lag_s, step / self.feedback_s);
        let [mut rate, mut acceleration, mut crystal] = start;
        let mut voltage = 0.0;
        let mut terms = [[0.0; 2]; TERMS];
        for (term, factor) in terms.iter_mut().zip(INVERSES) {
            *term = [crystal, voltage];
            voltage = -feedback * factor * (self.sensitivity * crystal + voltage);
            crystal = lag * factor * (rate - crystal);
            rate = step * factor * acceleration;
            acceleration = 0.0;
        }
        terms
    }

    pub(crate) fn check(&self) -> Result<(), EstimateError> {
        finite("sensitivity of the charge amplifier", self.sensitivity)?;
        positive("feedback time of the charge amplifier", self.feedback_s)?;
        positive("lag of the piezoelectric cell", self.lag_s)
    }
}

/// Covariance of white noise of unit density on the derivative of the acceleration: ∫ c(s) c(s)ᵀ ds
/// over the step, where c is the column of F̈, given by the terms of its U and V.
fn noise(step: f64, terms: &[[f64; 2]; TERMS]) -> Chain {
    // All nodes side by side: a polynomial at a time would wait for each of its products.
    let (mut crystals, mut voltages) = ([0.0; GAUSS.len()], [0.0; GAUSS.len()]);
    for term in terms.iter().rev() {
        for (i, (node, _)) in GAUSS.iter().enumerate() {
            crystals[i] = crystals[i] * node + term[0];
            voltages[i] = voltages[i] * node + term[1];
        }
    }
    let mut noise = Chain::zeros();
    for (i, (node, weight)) in GAUSS.iter().enumerate() {
        let s = node * step;
        let column = nalgebra::vector![0.5 * s * s, s, 1.0, crystals[i], voltages[i]];
        noise += (column * (weight * step)) * column.transpose();
    }
    noise
}
