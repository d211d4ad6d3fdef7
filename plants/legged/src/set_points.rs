//! Set-points of servos between commands.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

use crate::dynamics::StepInputs;

/// Course of the set-points of servos from one command to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SetPoint {
    /// Set-points equal the last command.
    #[default]
    Held,
    /// Set-points approach a command linearly, from their values at its arrival, over `period`, and
    /// are held afterwards.
    Linear {
        /// Control period, after which the next command is due.
        period: SimDuration,
    },
}

/// Set-points of servos. Those that approach their commands linearly divide steps, and have a
/// state; held ones are the commands.
#[derive(Debug, Clone)]
pub struct SetPoints {
    period: SimDuration,
    /// Empty if held.
    ramps: Vec<Ramp>,
    start: Vec<f64>,
    rates: Vec<f64>,
    mean: Vec<f64>,
}

/// Approach of a set-point to a command.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ramp {
    from: f64,
    to: f64,
    /// One period after the begin; the set-point equals `to` from then on.
    end: SimTime,
}

impl Ramp {
    /// Creates an approach that begins now.
    fn new(from: f64, to: f64, now: SimTime, period: SimDuration) -> Self {
        let end = if from == to { now } else { now + period };
        Self { from, to, end }
    }

    /// Returns the time since the begin of an approach that has not ended.
    fn elapsed(&self, now: SimTime, period: SimDuration) -> Option<SimDuration> {
        (now < self.end).then(|| period - (self.end - now))
    }

    fn value(&self, now: SimTime, period: SimDuration) -> f64 {
        let Some(elapsed) = self.elapsed(now, period) else {
            return self.to;
        };
        let share = elapsed.as_nanos() as f64 / period.as_nanos() as f64;
        self.from + (self.to - self.from) * share
    }
}

impl SetPoints {
    /// Creates set-points at rest at zero.
    pub fn new(set_point: SetPoint, count: usize) -> Self {
        let (period, count) = match set_point {
            SetPoint::Held => (SimDuration::ZERO, 0),
            SetPoint::Linear { period } => (period, count),
        };
        let zeros = vec![0.0; count];
        Self {
            period,
            ramps: vec![Ramp::default(); count],
            start: zeros.clone(),
            rates: zeros.clone(),
            mean: zeros,
        }
    }

    /// Places all set-points at rest at the initial inputs, which `initial_inputs` writes.
    pub fn reset(&mut self, initial_inputs: impl FnOnce(&mut [f64])) {
        if !self.are_linear() {
            return;
        }
        initial_inputs(&mut self.start);
        for (ramp, &at) in self.ramps.iter_mut().zip(&self.start) {
            *ramp = Ramp::new(at, at, SimTime::ZERO, self.period);
        }
    }

    /// Returns whether the set-points approach their commands linearly.
    pub fn are_linear(&self) -> bool {
        !self.ramps.is_empty()
    }

    /// Begins the approach to the commands that differ from those before.
    pub fn command(&mut self, now: SimTime, commands: &[f64]) {
        for (ramp, &command) in self.ramps.iter_mut().zip(commands) {
            if command != ramp.to {
                *ramp = Ramp::new(ramp.value(now, self.period), command, now, self.period);
            }
        }
    }

    /// Returns the end of the step from `now` to at most `next` in which all set-points are linear.
    pub fn step_end(&self, now: SimTime, next: SimTime) -> SimTime {
        let ends = self.ramps.iter().map(|ramp| ramp.end);
        ends.filter(|end| now < *end).fold(next, SimTime::min)
    }

    /// Returns the set-points over a step from `now` to at most [`Self::step_end`].
    pub fn over(&mut self, now: SimTime, next: SimTime) -> StepInputs<'_> {
        let half_s = 0.5 * (next - now).as_secs_f64();
        let period_s = self.period.as_secs_f64();
        let values = self.start.iter_mut().zip(&mut self.rates);
        for ((ramp, (start, rate)), mean) in self.ramps.iter().zip(values).zip(&mut self.mean) {
            (*start, *rate) = match ramp.elapsed(now, self.period) {
                Some(elapsed) => {
                    let rate = (ramp.to - ramp.from) / period_s;
                    (ramp.from + rate * elapsed.as_secs_f64(), rate)
                }
                None => (ramp.to, 0.0),
            };
            *mean = *start + *rate * half_s;
        }
        StepInputs {
            start: &self.start,
            rates: &self.rates,
            mean: &self.mean,
        }
    }

    /// Returns the state to be serialised.
    pub fn save(&self) -> Vec<Ramp> {
        self.ramps.clone()
    }

    /// Checks that a saved state can be restored.
    ///
    /// # Errors
    /// Description of the snapshot, if its set-points are not as many.
    pub fn check(&self, saved: &[Ramp]) -> Result<(), String> {
        if saved.len() == self.ramps.len() {
            return Ok(());
        }
        Err(format!("{} linear set-points", saved.len()))
    }

    /// Restores a checked state.
    pub fn restore(&mut self, saved: Vec<Ramp>) {
        self.ramps = saved;
    }
}
