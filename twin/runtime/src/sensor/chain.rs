use std::collections::VecDeque;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Stream, stream};

use super::rotation::{AXES, QUATERNION, turned};
use super::{SensorModel, SensorModelError};
use crate::TimeSource;

/// Greatest number of samples in transit for which memory is reserved; more allocate.
const RESERVED_MAX: u64 = 4096;

/// Place of a chain in a rig.
#[derive(Clone, Debug)]
pub(crate) struct ChainSite {
    /// Name of the signal.
    pub(crate) signal: String,
    /// The task that carries it.
    pub(crate) task: usize,
    /// Range of the signal in the results of the task.
    pub(crate) from: Range<usize>,
    /// The same in the inputs of the process.
    pub(crate) to: Range<usize>,
    /// Whether it is a unit quaternion.
    pub(crate) is_rotation: bool,
}

/// A sensor at one signal, between a task and the process.
pub(crate) struct SignalChain {
    /// Name of the sensor.
    pub(crate) name: String,
    pub(crate) site: ChainSite,
    pub(crate) model: SensorModel,
    pub(crate) state: ChainState,
}

/// State of a chain.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ChainState {
    /// Whether the process has begun, with the initial results of the task.
    has_begun: bool,
    /// Values at the process.
    delivered: Vec<f64>,
    /// Last values of the signal.
    signal: Vec<f64>,
    /// Values of the samples in transit, in their order, and their arrivals.
    in_transit: VecDeque<f64>,
    arrivals: VecDeque<SimTime>,
    last_arrival: SimTime,
    /// Time of the last sample.
    sampled: SimTime,
    /// Next multiple of the period.
    next_multiple: u64,
    /// Random walk of each element, or about each axis.
    walk: Vec<f64>,
    delay: TimeSource,
    /// A stream for each purpose, so that an effect more takes no number from another.
    noise: Stream,
    steps: Stream,
    losses: Stream,
}

impl SignalChain {
    /// Creates the chain of a sensor; the random streams are `sensor/NAME/SIGNAL/…`. Transfers are
    /// at least `interval` apart.
    pub(crate) fn new(
        name: &str,
        site: ChainSite,
        model: SensorModel,
        (seed, interval): (u64, SimDuration),
    ) -> Result<Self, SensorModelError> {
        model.check(site.is_rotation)?;
        let named = |purpose: &str| format!("sensor/{name}/{}/{purpose}", site.signal);
        let size = site.to.len();
        let interval = model.period.map_or(interval, |period| period.max(interval));
        let samples = model.delay.longest().as_nanos() / interval.as_nanos().max(1) + 2;
        let samples = usize::try_from(samples.min(RESERVED_MAX)).unwrap_or(0);
        let state = ChainState {
            has_begun: false,
            delivered: vec![0.0; size],
            signal: vec![0.0; size],
            in_transit: VecDeque::with_capacity(samples * size),
            arrivals: VecDeque::with_capacity(samples),
            last_arrival: SimTime::ZERO,
            sampled: SimTime::ZERO,
            next_multiple: 0,
            walk: vec![0.0; if site.is_rotation { AXES } else { size }],
            delay: model.delay.clone().source(seed, &named("delay"))?,
            noise: stream(seed, &named("noise")),
            steps: stream(seed, &named("random_walk")),
            losses: stream(seed, &named("drop_out")),
        };
        Ok(Self {
            name: name.to_owned(),
            site,
            model,
            state,
        })
    }

    /// Takes the results of the idle task, whose transfer has `ended` now or which has received
    /// them between transfers.
    pub(crate) fn handle_results(&mut self, now: SimTime, results: &[f64], ended: bool) {
        let values = &results[self.site.from.clone()];
        let mut bits = values.iter().zip(&self.state.signal);
        if !ended && bits.all(|(new, last)| new.to_bits() == last.to_bits()) {
            return;
        }
        self.state.signal.copy_from_slice(values);
        if let Some(period) = self.model.period {
            let multiple = now.as_nanos() / period.as_nanos();
            if multiple < self.state.next_multiple {
                return;
            }
            self.state.next_multiple = multiple + 1;
        }
        self.sample(now);
    }

    /// Samples the signal. All random numbers are drawn for a lost sample, too, so that the share
    /// of losses changes no other value.
    fn sample(&mut self, now: SimTime) {
        let elapsed_s = (now - self.state.sampled).as_secs_f64();
        self.state.sampled = now;
        let arrival = now.checked_add(self.state.delay.draw());
        let arrival = arrival.unwrap_or(SimTime::MAX);
        let (model, state) = (&self.model, &mut self.state);
        let is_lost = model.drop_out > 0.0 && state.losses.unit() < model.drop_out;
        if model.random_walk > 0.0 {
            // Increments of a Wiener process: independent, with a variance in ratio to the time.
            let deviation = model.random_walk * elapsed_s.sqrt();
            for walk in &mut state.walk {
                *walk += deviation * state.steps.normal();
            }
        }
        if !is_lost {
            state.last_arrival = state.last_arrival.max(arrival);
            state.arrivals.push_back(state.last_arrival);
        }
        let mut error = |element: usize| {
            let walked = model.bias + state.walk[element];
            if model.noise > 0.0 {
                walked + model.noise * state.noise.normal()
            } else {
                walked
            }
        };
        let transit = &mut state.in_transit;
        let mut send = |value: f64| {
            if !is_lost {
                transit.push_back(value);
            }
        };
        if !model.deviates() {
            let values = state.signal.iter();
            values.for_each(|&value| send(model.represent(value)));
        } else if self.site.is_rotation {
            let mut rotation = [0.0; QUATERNION];
            rotation.copy_from_slice(&state.signal);
            let turn = [error(0), error(1), error(2)];
            turned(rotation, turn).into_iter().for_each(send);
        } else {
            for (element, &value) in state.signal.iter().enumerate() {
                send(model.represent(value + error(element)));
            }
        }
    }

    /// Replaces the signal in the inputs of the process by the last sample that has arrived; before
    /// the first one it is the initial result of the task.
    pub(crate) fn deliver(&mut self, now: SimTime, inputs: &mut [f64]) {
        let (inputs, state) = (&mut inputs[self.site.to.clone()], &mut self.state);
        if !state.has_begun {
            state.delivered.copy_from_slice(inputs);
            state.signal.copy_from_slice(inputs);
            state.has_begun = true;
        }
        while state.arrivals.front().is_some_and(|at| *at <= now) {
            state.arrivals.pop_front();
            let arrived = state.in_transit.drain(..inputs.len());
            for (value, arrived) in state.delivered.iter_mut().zip(arrived) {
                *value = arrived;
            }
        }
        inputs.copy_from_slice(&state.delivered);
    }
}

/// Returns the sensors of a task.
pub(crate) fn of_task(
    sensors: &mut [SignalChain],
    task: usize,
) -> impl Iterator<Item = &mut SignalChain> {
    let sensors = sensors.iter_mut();
    sensors.filter(move |chain| chain.site.task == task)
}

#[cfg(test)]
mod tests;
