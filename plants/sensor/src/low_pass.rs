//! First-order low-pass filter.

use serde::{Deserialize, Serialize};

/// State of `T ẋ = u − x` for an input that is linear in time over each step; exact at any step
/// length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LowPass {
    pub(crate) value: f64,
}

/// Factors of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LowPassStep {
    /// e^(−h/T).
    decay: f64,
    /// T/h.
    lag: f64,
}

impl LowPassStep {
    /// Returns the factors for a time constant and a step \[s\].
    pub(crate) fn new(time_constant: f64, seconds: f64) -> Self {
        Self {
            decay: libm::exp(-seconds / time_constant),
            lag: time_constant / seconds,
        }
    }
}

impl LowPass {
    /// Advances by a step in which the input goes from `from` to `to`.
    pub(crate) fn advance(&mut self, step: &LowPassStep, from: f64, to: f64) {
        // A ramp is followed at a constant lag of T times its slope.
        let lag = step.lag * (to - from);
        self.value = to - lag + (self.value - from + lag) * step.decay;
    }
}
