//! Static response of the piezoresistive cell: sigmoids with hysteresis.

use serde::{Deserialize, Serialize};

use crate::error::{EstimateError, finite, require};

/// Sigmoid S(x) = a / (1 + exp(b (x + c))) + d (eq. 4.20), in volts over newtons. It rises if a and
/// b have opposite signs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sigmoid {
    /// Range \[V\].
    pub a: f64,
    /// Steepness \[1/N\]; for a > 0 negative, if the voltage rises with the force.
    pub b: f64,
    /// Negative of the force at half the range \[N\].
    pub c: f64,
    /// Asymptote \[V\].
    pub d: f64,
}

impl Sigmoid {
    /// Returns the value \[V\] and the derivative \[V/N\] at `force` \[N\]; no argument overflows.
    ///
    /// ```
    /// use twinrig_estimate::Sigmoid;
    ///
    /// let cell = Sigmoid { a: 4.0, b: -0.5, c: -5.0, d: 1.0 };
    /// assert_eq!(cell.at(5.0), (3.0, 0.5)); // half the range; a·|b|/4
    /// assert_eq!(cell.at(1e9), (5.0, 0.0)); // saturated
    /// ```
    #[inline]
    pub fn at(&self, force: f64) -> (f64, f64) {
        let (s, derivative) = logistic(-self.b * (force + self.c));
        (self.a * s + self.d, -self.a * self.b * derivative)
    }

    /// Returns the force \[N\] at which the sigmoid is `voltage` \[V\], or `None` outside the
    /// central part of its range, where the voltage does not determine the force.
    pub fn inverse(&self, voltage: f64) -> Option<f64> {
        let share = (voltage - self.d) / self.a;
        let determined = share > SATURATED && share < 1.0 - SATURATED;
        determined.then(|| libm::log(1.0 / share - 1.0) / self.b - self.c)
    }

    pub(crate) fn check(&self) -> Result<(), EstimateError> {
        for (entry, value) in [
            ("range a of a sigmoid", self.a),
            ("steepness b of a sigmoid", self.b),
        ] {
            let valid = value.is_finite() && value != 0.0;
            require(entry, value, valid, "finite and not zero")?;
        }
        finite("centre c of a sigmoid", self.c)?;
        finite("asymptote d of a sigmoid", self.d)
    }
}

/// Share of the range next to each asymptote in which a sigmoid counts as saturated. ASSUMED: the
/// slope there is below 8 % of the greatest one.
const SATURATED: f64 = 0.02;

/// Returns 1/(1 + exp(−z)) and its derivative s(1 − s). The exponential has a negative argument, so
/// it underflows to zero and never overflows, and the product is never 0·∞.
#[inline]
fn logistic(z: f64) -> (f64, f64) {
    let e = libm::exp(-z.abs());
    let small = e / (1.0 + e); // 1 − s for z ≥ 0, else s, without cancellation
    let great = 1.0 / (1.0 + e);
    (if z < 0.0 { small } else { great }, small * great)
}

/// Response with hysteresis (eq. 4.21): h(F, Ḟ) = w S₁(F) + (1 − w) S₂(F), where S₁ is the loading
/// branch, S₂ the unloading one, and w = 1/(1 + exp(−switch·Ḟ)).
///
/// Sign: w tends to 1 for a rising force, Ḟ > 0. Eq. 4.21 has the same weight as S(1, b, 0, 0) of
/// eq. 4.20 with b = −`switch`, so `switch` is positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hysteresis {
    /// Branch of rising forces.
    pub loading: Sigmoid,
    /// Branch of falling forces.
    pub unloading: Sigmoid,
    /// Steepness of the change between the branches \[s/N\].
    pub switch: f64,
}

/// Value and gradient of the piezoresistive response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// Voltage \[V\].
    pub voltage: f64,
    /// Derivative with respect to the force \[V/N\].
    pub by_force: f64,
    /// Derivative with respect to its rate \[V·s/N\].
    pub by_rate: f64,
}

impl Hysteresis {
    /// Returns the voltage and its gradient at a force \[N\] and a rate \[N/s\].
    #[inline]
    pub fn at(&self, force: f64, rate: f64) -> Gradient {
        let (weight, slope) = logistic(self.switch * rate);
        let (loading, by_force_loading) = self.loading.at(force);
        let (unloading, by_force_unloading) = self.unloading.at(force);
        Gradient {
            voltage: weight * loading + (1.0 - weight) * unloading,
            by_force: weight * by_force_loading + (1.0 - weight) * by_force_unloading,
            by_rate: self.switch * slope * (loading - unloading),
        }
    }
}

/// Response of the piezoresistive cell with its amplifier.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ForceResponse {
    /// V = gain·F + offset.
    Linear {
        /// Gain \[V/N\].
        gain: f64,
        /// Voltage without force \[V\].
        offset: f64,
    },
    /// Saturation and hysteresis.
    Hysteresis(Hysteresis),
}

impl ForceResponse {
    /// Returns the voltage and its gradient at a force \[N\] and a rate \[N/s\].
    #[inline]
    pub fn at(&self, force: f64, rate: f64) -> Gradient {
        match self {
            Self::Linear { gain, offset } => Gradient {
                voltage: gain * force + offset,
                by_force: *gain,
                by_rate: 0.0,
            },
            Self::Hysteresis(hysteresis) => hysteresis.at(force, rate),
        }
    }

    /// Returns a force \[N\] near which the response at `rate` \[N/s\] is `voltage` \[V\]: the mean
    /// of both branches' inverses with the weights of the rate. `None` if the response is linear,
    /// whose gradient is the same everywhere, or saturated on both branches.
    pub(crate) fn explain(&self, voltage: f64, rate: f64) -> Option<f64> {
        let Self::Hysteresis(hysteresis) = self else {
            return None;
        };
        let loading = hysteresis.loading.inverse(voltage);
        let unloading = hysteresis.unloading.inverse(voltage);
        match (loading, unloading) {
            (Some(loading), Some(unloading)) => {
                let (weight, _) = logistic(hysteresis.switch * rate);
                Some(weight * loading + (1.0 - weight) * unloading)
            }
            (one, other) => one.or(other),
        }
    }

    pub(crate) fn check(&self) -> Result<(), EstimateError> {
        match self {
            Self::Linear { gain, offset } => {
                finite("gain of the piezoresistive cell", *gain)?;
                finite("offset of the piezoresistive cell", *offset)
            }
            Self::Hysteresis(hysteresis) => {
                hysteresis.loading.check()?;
                hysteresis.unloading.check()?;
                finite("switch of the hysteresis", hysteresis.switch)
            }
        }
    }
}
