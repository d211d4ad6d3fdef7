//! Butterworth low-pass filter as second-order sections.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::{EstimateError, positive, require};

/// Second-order section (b₀ + b₁ z⁻¹ + b₂ z⁻²)/(1 + a₁ z⁻¹ + a₂ z⁻²).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Numerator b₀, b₁, b₂.
    pub b: [f64; 3],
    /// Denominator a₁, a₂.
    pub a: [f64; 2],
}

impl Section {
    /// Gain for a constant input.
    fn gain(&self) -> f64 {
        (self.b[0] + self.b[1] + self.b[2]) / (1.0 + self.a[0] + self.a[1])
    }

    /// Delays for the constant input `x`.
    fn settled(&self, x: f64) -> [f64; 2] {
        let y = self.gain() * x;
        [y - self.b[0] * x, self.b[2] * x - self.a[1] * y]
    }

    /// Transposed direct form II.
    #[inline]
    fn step(&self, delays: &mut [f64; 2], x: f64) -> f64 {
        let y = self.b[0] * x + delays[0];
        delays[0] = self.b[1] * x - self.a[0] * y + delays[1];
        delays[1] = self.b[2] * x - self.a[1] * y;
        y
    }
}

/// Butterworth low-pass filter of even order, by the bilinear transform with the cut-off frequency
/// kept.
///
/// ```
/// use twinrig_estimate::Butterworth;
///
/// let mut low_pass = Butterworth::new(4, 10.0, 1000.0)?; // the thesis': 4th order, 10 Hz at 1 kHz
/// assert!((low_pass.group_delay_s() - 0.0416).abs() < 1e-4); // 42 ms, which a bench has to report
/// low_pass.settle(3.0);
/// assert!((low_pass.step(3.0) - 3.0).abs() < 1e-12);
/// # Ok::<(), twinrig_estimate::EstimateError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Butterworth {
    sections: Vec<Section>,
    delays: Vec<[f64; 2]>,
    group_delay_s: f64,
}

impl Butterworth {
    /// Designs a filter of an even `order` with its −3 dB point at `cutoff_hz` for samples at
    /// `rate_hz`, at rest at zero.
    ///
    /// # Errors
    /// [`EstimateError::Value`] if the order is odd, zero or above 20, or the cut-off frequency is
    /// not between zero and half the rate.
    pub fn new(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<Self, EstimateError> {
        let valid = order.is_multiple_of(2) && (2..=20).contains(&order);
        require("order", order as f64, valid, "even, from 2 to 20")?;
        positive("sample rate", rate_hz)?;
        let valid = cutoff_hz > 0.0 && cutoff_hz < 0.5 * rate_hz;
        require(
            "cut-off frequency",
            cutoff_hz,
            valid,
            "between zero and half the sample rate",
        )?;
        let warped = libm::tan(PI * cutoff_hz / rate_hz);
        let square = warped * warped;
        let (mut gain, mut delay) = (1.0, 0.0);
        let mut sections = Vec::with_capacity(order / 2);
        // Poles ordered as by SciPy: those next to the unit circle last.
        for pair in (0..order / 2).rev() {
            let damping = libm::sin(PI * (2 * pair + 1) as f64 / (2 * order) as f64);
            let a0 = 1.0 + 2.0 * damping * warped + square;
            gain *= square / a0;
            delay += damping / warped;
            sections.push(Section {
                b: [1.0, 2.0, 1.0],
                a: [
                    2.0 * (square - 1.0) / a0,
                    (1.0 - 2.0 * damping * warped + square) / a0,
                ],
            });
        }
        sections[0].b = [gain, 2.0 * gain, gain];
        Ok(Self {
            delays: vec![[0.0; 2]; sections.len()],
            sections,
            group_delay_s: delay / rate_hz,
        })
    }

    /// Returns the sections, from input to output.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Returns the delay of slow signals by [`step`](Self::step) \[s\]: the group delay at 0 Hz, in
    /// closed form `Σ ζ/tan(π f_c/f_s)` samples over the dampings ζ of the pole pairs.
    pub fn group_delay_s(&self) -> f64 {
        self.group_delay_s
    }

    /// Sets the steady state of the constant input `x`.
    pub fn settle(&mut self, mut x: f64) {
        for (section, delays) in self.sections.iter().zip(&mut self.delays) {
            *delays = section.settled(x);
            x *= section.gain();
        }
    }

    /// Filters the next sample.
    #[inline]
    pub fn step(&mut self, x: f64) -> f64 {
        let sections = self.sections.iter().zip(&mut self.delays);
        sections.fold(x, |x, (section, delays)| section.step(delays, x))
    }

    /// Filters `samples` forwards and backwards: no delay, and the square of the gain. The ends are
    /// continued by odd reflection over 3·(order + 1) samples, from the steady state of the first;
    /// that is `scipy.signal.sosfiltfilt` with its defaults. The streaming state is not used.
    ///
    /// # Errors
    /// [`EstimateError::Length`] for 3·(order + 1) samples or fewer.
    pub fn zero_phase(&self, samples: &[f64]) -> Result<Vec<f64>, EstimateError> {
        let edge = 3 * (2 * self.sections.len() + 1);
        if samples.len() <= edge {
            return Err(EstimateError::Length {
                entry: "samples",
                found: samples.len(),
                required: format!("more than {edge} are required"),
            });
        }
        let last = samples.len() - 1;
        let before = (1..=edge).rev().map(|i| 2.0 * samples[0] - samples[i]);
        let after = (1..=edge).map(|i| 2.0 * samples[last] - samples[last - i]);
        let mut padded: Vec<f64> = before.chain(samples.iter().copied()).chain(after).collect();
        let mut filter = self.clone();
        for _ in 0..2 {
            filter.settle(padded[0]);
            for sample in &mut padded {
                *sample = filter.step(*sample);
            }
            padded.reverse();
        }
        Ok(padded[edge..edge + samples.len()].to_vec())
    }
}
