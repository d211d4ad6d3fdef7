use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

use crate::{RigError, Timing};

/// Default of the maximum number of events at one instant.
pub(crate) const EVENTS_MAX: u32 = 100_000;

/// Schedule of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// Step of the manager: the period of the fastest I/O.
    pub step: SimDuration,
    /// Control period in steps.
    pub every: u64,
    /// Period of the observation grid, which begins at 0.
    pub observe: SimDuration,
    /// Compute time of an iteration of the process, drawn from the stream `process/compute`.
    pub compute: Timing,
    /// Seed of the run.
    pub seed: u64,
    /// Maximum number of events at one instant; more are an error.
    pub events_max: u32,
}

impl Schedule {
    /// Creates a schedule with control period `period`, zero compute time, observation every 2 ms
    /// and seed 1.
    #[must_use]
    pub fn with_period(period: SimDuration) -> Self {
        Self {
            step: period,
            every: 1,
            observe: SimDuration::from_millis(2),
            compute: Timing::ZERO,
            seed: 1,
            events_max: EVENTS_MAX,
        }
    }

    /// Returns the control period: `every` steps.
    ///
    /// # Errors
    /// [`RigError::BadPeriod`] if it is zero or past 584 years.
    pub fn period(&self) -> Result<SimDuration, RigError> {
        self.step
            .checked_mul(self.every)
            .filter(|period| !period.is_zero())
            .ok_or(RigError::BadPeriod { what: "control" })
    }
}

/// Checks the period of an observation grid.
pub(crate) fn check_observation_period(observe: SimDuration) -> Result<(), RigError> {
    if observe.is_zero() {
        return Err(RigError::BadPeriod {
            what: "observation",
        });
    }
    Ok(())
}

/// Returns for how long a transfer may occupy its task by the periods: the nominal duration on the
/// control grid, if that is longer than a control step; otherwise zero.
pub(crate) fn implied_busy(nominal: Option<SimDuration>, control: SimDuration) -> SimDuration {
    let steps = nominal.map_or(0, |it| it.as_nanos().div_ceil(control.as_nanos()));
    if steps > 1 {
        control.checked_mul(steps).unwrap_or(control)
    } else {
        SimDuration::ZERO
    }
}

/// Change of a process variable during a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Change {
    /// Sets the value.
    To(f64),
    /// Adds to the value.
    By(f64),
}

/// Returns the value of a variable that approaches `target` by `rate` per second at most, a control
/// period after it was `present`.
#[must_use]
pub fn slewed(present: f64, target: f64, rate: f64, period: SimDuration) -> f64 {
    let step = rate * period.as_secs_f64();
    if (target - present).abs() <= step {
        target
    } else {
        present + step.copysign(target - present)
    }
}
