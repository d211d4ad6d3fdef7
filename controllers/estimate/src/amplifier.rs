//! Charge amplifier behind the elastic layers of the piezoelectric cell, in discrete time.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use crate::error::{EstimateError, finite, positive};

/// Piezoelectric cell with its charge amplifier: V/F = −k s / ((1 + s T₁)(1 + s T₂)).
///
/// As states, with the crystal's rate U \[N/s\]: T₂ U̇ = Ḟ − U, T₁ V̇ = −k U − V. Both poles differ
/// from those of the force, so two states are the least number; the form holds for T₁ = T₂, too.
///
/// At low frequencies V ≈ −k Ḟ + k (T₁ + T₂) F̈: a rate sensor with a coefficient of acceleration of
/// the opposite sign.
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
/// Terms of the series: 0.25¹⁵/15! is 10⁻²¹.
const TERMS: usize = 16;

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
        let by_rate = self.column(step, [1.0, 0.0, 0.0, 0.0]);
        let by_acceleration = self.column(step, [0.0, 1.0, 0.0, 0.0]);
        let by_crystal = self.column(step, [0.0, 0.0, 1.0, 0.0]);
        let by_voltage = self.column(step, [0.0, 0.0, 0.0, 1.0]);
        let mut transition = Chain::identity();
        transition[(0, 1)] = step;
        transition[(0, 2)] = 0.5 * step * step;
        transition[(1, 2)] = step;
        for (column, terms) in [by_rate, by_acceleration, by_crystal, by_voltage]
            .iter()
            .enumerate()
        {
            for (row, terms) in terms.iter().enumerate() {
                transition[(3 + row, 1 + column)] = terms.iter().rev().sum();
            }
        }
        // The noise enters with the acceleration: Q = ∫ c(s) c(s)ᵀ ds, c the column of F̈.
        let mut noise = Chain::zeros();
        for (node, weight) in GAUSS {
            let s = node * step;
            let [crystal, voltage] = by_acceleration.map(|terms| {
                let horner = |sum: f64, term: &f64| sum * node + term;
                terms.iter().rev().fold(0.0, horner)
            });
            let column = nalgebra::vector![0.5 * s * s, s, 1.0, crystal, voltage];
            noise += (column * (weight * step)) * column.transpose();
        }
        (transition, noise)
    }

    /// Terms of the Taylor series of (U, V) over `step` from a start (Ḟ, F̈, U, V).
    fn column(&self, step: f64, start: [f64; 4]) -> [[f64; TERMS]; 2] {
        let (lag, feedback) = (step / self.lag_s, step / self.feedback_s);
        let [mut rate, mut acceleration, mut crystal, mut voltage] = start;
        let (mut crystals, mut voltages) = ([0.0; TERMS], [0.0; TERMS]);
        for n in 0..TERMS {
            crystals[n] = crystal;
            voltages[n] = voltage;
            let order = 1.0 / (n + 1) as f64;
            voltage = -feedback * (self.sensitivity * crystal + voltage) * order;
            crystal = lag * (rate - crystal) * order;
            rate = step * acceleration * order;
            acceleration = 0.0;
        }
        [crystals, voltages]
    }

    pub(crate) fn check(&self) -> Result<(), EstimateError> {
        finite("sensitivity of the charge amplifier", self.sensitivity)?;
        positive("feedback time of the charge amplifier", self.feedback_s)?;
        positive("lag of the piezoelectric cell", self.lag_s)
    }
}
