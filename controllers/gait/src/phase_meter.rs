//! Mean rate of the phase of a leg.

use serde::{Deserialize, Serialize};

/// Meter of the mean phase rate of a leg over its last whole cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct PhaseMeter {
    /// Fraction of the cycle at the last step; `None` before the first.
    last: Option<f64>,
    /// Cycles and time \[s\] since the last cycle was complete.
    travelled: f64,
    elapsed: f64,
    /// Of the last cycle \[Hz\].
    frequency: Option<f64>,
}

impl PhaseMeter {
    /// Processes a step of `seconds` that ends at the fraction `turn` of the cycle.
    pub(crate) fn step(&mut self, seconds: f64, turn: f64) {
        if let Some(last) = self.last.replace(turn) {
            let change = turn - last;
            self.travelled += change - change.round();
            self.elapsed += seconds;
        }
        if self.travelled.abs() >= 1.0 && self.elapsed > 0.0 {
            self.frequency = Some(self.travelled / self.elapsed);
            (self.travelled, self.elapsed) = (0.0, 0.0);
        }
    }

    /// Mean rate over the last whole cycle \[Hz\]; `None` before the first is complete.
    pub(crate) fn frequency(&self) -> Option<f64> {
        self.frequency
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_phase_has_its_frequency_and_a_changing_one_the_mean_over_a_cycle() {
        let mut meter = PhaseMeter::default();
        for n in 0..200 {
            meter.step(2e-3, (3.0 * 2e-3 * f64::from(n)).fract());
        }
        let frequency = meter.frequency().unwrap();
        assert!((frequency - 3.0).abs() < 1e-9, "{frequency}");
        // A rate that oscillates within the cycle has the same mean.
        let mut meter = PhaseMeter::default();
        for n in 0..8000 {
            let even = 3.0 * 1e-4 * f64::from(n);
            let uneven = even + 0.05 * libm::sin(std::f64::consts::TAU * even);
            meter.step(1e-4, uneven.fract());
        }
        let frequency = meter.frequency().unwrap();
        assert!((frequency - 3.0).abs() < 0.01, "{frequency}");
    }
}
