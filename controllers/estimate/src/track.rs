//! History of an estimate: measurements at their own time stamps, in order of time.

use std::collections::VecDeque;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::estimate::Estimate;
use crate::kalman::{Innovation, Kalman};
use crate::measurement::{Channel, Counters, Measurement, Outcome};
use crate::model::{Dynamics, StateSettings};
use crate::response::Gradient;
use crate::settings::{Piezoresistive, Settings};

/// Measurements that can be applied again: at 1 kHz and two channels, 32 ms.
pub(crate) const HISTORY: usize = 64;

/// Greatest number of states of a model.
const N_MAX: usize = 8;

/// Greatest magnitude of a measurement, in V or rad/s: far beyond any sensor, and far from overflow
/// of what follows from it.
const GREATEST: f64 = 1e9;

/// Everything that a measurement changes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Moment<const N: usize> {
    kalman: Kalman<N>,
    /// Time of the newest measurement \[ns\]; `None` before the first.
    at_ns: Option<u64>,
    /// Sum of ν²/S of the measurements at `at_ns`, and their number.
    nis: f64,
    nis_count: u32,
    innovations: [Option<Innovation>; Channel::COUNT],
    /// Updates that were linearised at the measured voltage.
    recoveries: u64,
}

/// A measurement with the state before it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Entry<const N: usize> {
    measurement: Measurement,
    before: Moment<N>,
}

/// Filter with the history of its newest measurements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Track<M, const N: usize> {
    model: M,
    settings: Settings,
    /// Process variances per second.
    noise: [f64; N_MAX],
    now: Moment<N>,
    history: VecDeque<Entry<N>>,
    /// Time and channel of the newest measurement that left the history.
    forgotten: Option<(u64, Channel)>,
    counters: Counters,
}

impl<M: Dynamics<N>, const N: usize> Track<M, N> {
    /// Creates a track; the settings have been checked.
    pub(crate) fn new(model: M, states: &[StateSettings; N], settings: &Settings) -> Self {
        let state = SVector::from(states.map(|state| state.initial));
        let variances = SVector::from(states.map(|state| state.variance));
        let mut noise = [0.0; N_MAX];
        for (noise, state) in noise.iter_mut().zip(states) {
            *noise = state.noise / settings.period_s;
        }
        let kalman = Kalman::new(state, nalgebra::SMatrix::from_diagonal(&variances))
            .expect("the settings have been checked");
        Self {
            model,
            settings: *settings,
            noise,
            now: Moment {
                kalman,
                at_ns: None,
                nis: 0.0,
                nis_count: 0,
                innovations: [None; Channel::COUNT],
                recoveries: 0,
            },
            history: VecDeque::with_capacity(HISTORY + 1),
            forgotten: None,
            counters: Counters::default(),
        }
    }

    pub(crate) fn push(&mut self, measurement: Measurement) -> Outcome {
        let key = measurement.key();
        let valid = measurement.value.abs() <= GREATEST; // false for NaN
        if !valid {
            self.counters.invalid += 1;
            return Outcome::Invalid;
        }
        let Some(noise) = self.noise_of(measurement.channel) else {
            self.counters.ignored += 1;
            return Outcome::Ignored;
        };
        if self.forgotten.is_some_and(|forgotten| key <= forgotten) {
            self.counters.too_old += 1;
            return Outcome::TooOld;
        }
        let is_after = |entry: &Entry<N>| entry.measurement.key() > key;
        let later = self
            .history
            .iter()
            .rev()
            .take_while(|entry| is_after(entry));
        let place = self.history.len() - later.count();
        if place > 0 && self.history[place - 1].measurement.key() == key {
            self.counters.duplicate += 1;
            return Outcome::Duplicate;
        }
        let late = place < self.history.len();
        if late {
            self.now = self.history[place].before;
        }
        let before = self.now;
        self.history.insert(
            place,
            Entry {
                measurement,
                before,
            },
        );
        self.apply(&measurement, noise);
        for later in place + 1..self.history.len() {
            self.history[later].before = self.now;
            let measurement = self.history[later].measurement;
            if let Some(noise) = self.noise_of(measurement.channel) {
                self.apply(&measurement, noise);
            }
        }
        if self.history.len() > HISTORY {
            self.forgotten = self
                .history
                .pop_front()
                .map(|entry| entry.measurement.key());
        }
        if late {
            self.counters.late += 1;
            Outcome::Late
        } else {
            self.counters.applied += 1;
            Outcome::Applied
        }
    }

    /// Variance of a channel's noise, if the channel is used.
    fn noise_of(&self, channel: Channel) -> Option<f64> {
        match channel {
            Channel::Piezoresistive => self.settings.piezoresistive.map(|cell| cell.variance),
            Channel::Piezoelectric => self.settings.piezoelectric,
            Channel::Frequency => M::FREQUENCY.and(self.settings.frequency),
        }
    }

    /// Predicts from the newest measurement of `moment` to `at_ns`, which is not before it.
    fn predict(&self, moment: &mut Moment<N>, at_ns: u64) {
        let elapsed = moment.at_ns.map_or(0, |last| at_ns - last);
        if elapsed > 0 {
            // A division: 10⁶ ns are then the double nearest to 1 ms.
            let seconds = elapsed as f64 / 1e9;
            let (transition, mut noise) = self.model.transition(seconds, self.settings.white);
            for i in 0..N {
                noise[(i, i)] += self.noise[i] * seconds;
            }
            moment.kalman.predict(&transition, &noise);
        }
    }

    /// Applies a measurement that is not before the newest one, with noise variance `noise`.
    fn apply(&mut self, measurement: &Measurement, noise: f64) {
        let mut now = self.now;
        self.predict(&mut now, measurement.at_ns);
        if now.at_ns != Some(measurement.at_ns) {
            (now.nis, now.nis_count) = (0.0, 0);
        }
        now.at_ns = Some(measurement.at_ns);
        let state = now.kalman.state();
        let (expected, gradient) = match (measurement.channel, &self.settings.piezoresistive) {
            (Channel::Piezoelectric, _) => self.model.piezoelectric(state),
            (Channel::Piezoresistive, Some(cell)) => {
                let recovery = self.settings.recovery;
                let creep = self.model.creep();
                let (line, recovered) =
                    linearise(&now.kalman, cell, creep, recovery, measurement.value);
                now.recoveries += u64::from(recovered);
                line
            }
            (Channel::Piezoresistive, None) => (0.0, SVector::zeros()),
            (Channel::Frequency, _) => M::FREQUENCY.map_or((0.0, SVector::zeros()), |index| {
                (
                    state[index],
                    SVector::from_fn(|row, _| f64::from(u8::from(row == index))),
                )
            }),
        };
        let value = measurement.value;
        // An innovation that overflows is the only error left; the prediction remains.
        if let Ok(innovation) = now.kalman.update(value, expected, &gradient, noise) {
            now.nis += innovation.nis();
            now.nis_count += 1;
            now.innovations[measurement.channel as usize] = Some(innovation);
        }
        self.now = now;
    }

    pub(crate) fn estimate(&self) -> Estimate {
        self.now.estimate()
    }

    pub(crate) fn estimate_at(&self, at_ns: u64) -> Option<Estimate> {
        let is_past = |moment: &&Moment<N>| moment.at_ns.is_none_or(|last| last <= at_ns);
        let past = self.history.iter().rev().map(|entry| &entry.before);
        let mut moment = *std::iter::once(&self.now).chain(past).find(is_past)?;
        self.predict(&mut moment, at_ns);
        moment.at_ns = Some(at_ns);
        Some(moment.estimate())
    }

    pub(crate) fn counters(&self) -> Counters {
        self.counters
    }

    pub(crate) fn kalman(&self) -> &Kalman<N> {
        &self.now.kalman
    }
}

impl<const N: usize> Moment<N> {
    fn estimate(&self) -> Estimate {
        let (state, covariance) = (self.kalman.state(), self.kalman.covariance());
        let deviation = |index: usize| covariance[(index, index)].max(0.0).sqrt();
        Estimate {
            at_ns: self.at_ns,
            force: state[0],
            deviation: deviation(0),
            rate: state[1],
            rate_deviation: deviation(1),
            bias: state[N - 1],
            nis: self.nis,
            nis_count: self.nis_count,
            innovations: self.innovations,
            recoveries: self.recoveries,
        }
    }
}

/// Returns value and gradient of the piezoresistive response at the estimate, extrapolated from the
/// point of linearisation, and whether that is the measured voltage. `creep`: index of the state
/// and voltage that does not creep.
fn linearise<const N: usize>(
    kalman: &Kalman<N>,
    cell: &Piezoresistive,
    creep: Option<(usize, f64)>,
    recovery: Option<f64>,
    measured: f64,
) -> ((f64, SVector<f64, N>), bool) {
    let (state, covariance) = (kalman.state(), kalman.covariance());
    let [force, rate] = [state[0], state[1]];
    let (factor, floor) = creep.map_or((1.0, 0.0), |(index, floor)| (1.0 + state[index], floor));
    let full = |point: &Gradient| {
        let mut gradient = SVector::zeros();
        gradient[0] = factor * point.by_force;
        gradient[1] = factor * point.by_rate;
        if let Some((index, floor)) = creep {
            gradient[index] = point.voltage - floor;
        }
        gradient
    };
    let crept = |voltage: f64| match creep {
        // Not `floor + 1 · (voltage − floor)`, which rounds.
        None => voltage,
        Some(_) => floor + factor * (voltage - floor),
    };
    let here = cell.response.at(force, rate);
    let line = (crept(here.voltage), full(&here));
    let Some(threshold) = recovery else {
        return (line, false);
    };
    let error = measured - line.0;
    let variance = line.1.dot(&(covariance * line.1)) + cell.variance;
    if error * error <= threshold * variance {
        return (line, false);
    }
    // The estimate does not explain the measurement. Where the response is steeper at the force
    // that does, its line is the better one: here it may be saturated.
    let fresh = if creep.is_some() && factor > 0.0 {
        floor + (measured - floor) / factor
    } else {
        measured
    };
    let explained = cell.response.explain(fresh, rate);
    let there = explained.map(|force| (force, cell.response.at(force, rate)));
    match there {
        Some((point, there)) if there.by_force.abs() > here.by_force.abs() => {
            let expected = crept(there.voltage) + factor * there.by_force * (force - point);
            ((expected, full(&there)), true)
        }
        _ => (line, false),
    }
}
