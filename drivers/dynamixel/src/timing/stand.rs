use std::f64::consts::TAU;
use std::ops::Range;

use twinrig_kernel::{Port, SimTime, Unit};
use twinrig_runtime::{PlantAccess, PlantFault, PlantSignals};

use crate::config::ServoConfig;

/// Angles by which samples are told apart \[rad\]: above a count of each model, all within the
/// range of an AX-12A.
const STEP: f64 = 0.006;
pub(super) const STEPS: usize = 800;

/// Joints whose angle changes by a step with each sample, whatever their motors do, so that an
/// angle tells when it was sampled.
pub(super) struct Stand {
    outputs: Vec<f64>,
    inputs: Vec<f64>,
    /// Times of the last samples of each joint, by their steps.
    sampled: Vec<Vec<SimTime>>,
    /// Number of samples of each joint, and of those with one angle.
    samples: Vec<usize>,
    held: usize,
    /// Present time.
    pub(super) now: SimTime,
}

impl Stand {
    /// Creates it with its signals.
    pub(super) fn new(servos: &[ServoConfig]) -> (Self, PlantSignals) {
        let ports = servos.iter().flat_map(|ServoConfig { signals: of, .. }| {
            [
                Port::output(&of.angle, Unit::Radian, 1),
                Port::output(&of.rate, Unit::RadianPerSecond, 1),
                Port::input(&of.duty, Unit::One, 1),
                Port::input(&of.bridge, Unit::One, 1),
            ]
        });
        let signals = PlantSignals::of(&ports.collect::<Vec<_>>());
        let stand = Self {
            outputs: vec![0.0; signals.outputs.len()],
            inputs: vec![0.0; signals.inputs.len()],
            sampled: vec![vec![SimTime::ZERO; STEPS]; servos.len()],
            samples: vec![0; servos.len()],
            held: 1,
            now: SimTime::ZERO,
        };
        (stand, signals)
    }

    /// Lets so many samples have one angle, so that older ones are told apart; times are those of
    /// the first of them.
    pub(super) fn hold(&mut self, samples: usize) {
        self.held = samples;
        self.samples.fill(0);
        for sampled in &mut self.sampled {
            sampled.fill(self.now);
        }
    }

    /// Returns the time of the oldest sample of these angles, one of each joint \[rad\].
    pub(super) fn oldest(&self, angles: &[f64]) -> SimTime {
        let sampled = angles.iter().zip(&self.sampled).map(|(angle, sampled)| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "within a turn"
            )]
            let step = libm::rint((angle - first()).rem_euclid(TAU) / STEP) as usize;
            sampled.get(step).copied().unwrap_or_default()
        });
        sampled.min().unwrap_or(self.now)
    }
}

/// Angle of the first step \[rad\].
fn first() -> f64 {
    -0.5 * STEP * STEPS as f64
}

impl PlantAccess for Stand {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        // Each joint has two outputs, of which the first is the angle.
        let joint = signals.start / 2;
        if signals.start.is_multiple_of(2) {
            let step = self.samples[joint] / self.held % STEPS;
            if self.samples[joint].is_multiple_of(self.held) {
                self.sampled[joint][step] = self.now;
            }
            self.samples[joint] += 1;
            self.outputs[signals.start] = first() + STEP * step as f64;
        }
        Ok(&self.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut self.inputs[signals])
    }
}
