//! Set-points of servos between commands.
//!
//! Steps end where an approach to a command ends, so in every step all set-points are linear in
//! time. `Dynamics` get their values, rates and means. The servos of hip abduction use the same
//! type.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

/// Inputs of the drives over a step, linear in time, in the order of the ports: hip and pulley of
/// each leg as angles \[rad\], or voltage \[V\] and bridge of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepInputs<'i> {
    /// Inputs at the beginning of the step.
    pub start: &'i [f64],
    /// Rates of the inputs \[1/s\].
    pub rates: &'i [f64],
    /// Mean inputs over the step, for dynamics that hold their inputs over a step.
    pub mean: &'i [f64],
}

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
    /// Returns a set-point at rest.
    fn at(value: f64) -> Self {
        Self {
            from: value,
            to: value,
            end: SimTime::ZERO,
        }
    }

    fn has_ended(&self, now: SimTime) -> bool {
        now >= self.end
    }

    /// Returns the time since the begin of an approach that has not ended.
    fn elapsed(&self, now: SimTime, period: SimDuration) -> SimDuration {
        period - (self.end - now)
    }

    fn value(&self, now: SimTime, period: SimDuration) -> f64 {
        if self.has_ended(now) {
            return self.to;
        }
        let share = self.elapsed(now, period).as_nanos() as f64 / period.as_nanos() as f64;
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
            *ramp = Ramp::at(at);
        }
    }

    /// Returns whether the set-points approach their commands linearly.
    pub fn are_linear(&self) -> bool {
        !self.ramps.is_empty()
    }

    /// Begins the approach to the commands that differ from those before.
    pub fn command(&mut self, now: SimTime, commands: &[f64]) {
        let end = now + self.period;
        for (ramp, &to) in self.ramps.iter_mut().zip(commands) {
            if to != ramp.to {
                let from = ramp.value(now, self.period);
                let end = if from == to { now } else { end };
                *ramp = Ramp { from, to, end };
            }
        }
    }

    /// Returns the end of the step from `now` to at most `next` in which all set-points are linear.
    pub fn step_end(&self, now: SimTime, next: SimTime) -> SimTime {
        let approaches = self.ramps.iter().filter(|ramp| !ramp.has_ended(now));
        approaches.map(|ramp| ramp.end).fold(next, SimTime::min)
    }

    /// Returns the set-points over a step from `now` to at most [`Self::step_end`].
    pub fn over(&mut self, now: SimTime, next: SimTime) -> StepInputs<'_> {
        let half_s = 0.5 * (next - now).as_secs_f64();
        let period_s = self.period.as_secs_f64();
        // The set-points of one command have the same end, and thus the same time elapsed.
        let (mut end, mut elapsed_s) = (now, 0.0);
        let values = self.start.iter_mut().zip(&mut self.rates);
        for ((ramp, (start, rate)), mean) in self.ramps.iter().zip(values).zip(&mut self.mean) {
            if ramp.has_ended(now) {
                (*start, *rate) = (ramp.to, 0.0);
            } else {
                if ramp.end != end {
                    end = ramp.end;
                    elapsed_s = ramp.elapsed(now, self.period).as_secs_f64();
                }
                *rate = (ramp.to - ramp.from) / period_s;
                *start = ramp.from + *rate * elapsed_s;
            }
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
