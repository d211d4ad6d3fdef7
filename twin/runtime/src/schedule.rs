use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

use crate::{RigError, Timing};

/// When a rig does what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// Step of the manager: the fastest I/O.
    pub step: SimDuration,
    /// The process runs every so many steps.
    pub every: u64,
    /// Period of the observation grid, which begins at 0.
    pub observe: SimDuration,
    /// How long an iteration of the process takes; drawn from the stream `process/compute`.
    pub compute: Timing,
    /// Seed of the run.
    pub seed: u64,
    /// More events than this at one instant are an error.
    pub events_max: u32,
}

impl Schedule {
    /// The process runs every `period` and takes no time; the plant is observed every 2 ms; seed 1.
    #[must_use]
    pub fn with_period(period: SimDuration) -> Self {
        Self {
            step: period,
            every: 1,
            observe: SimDuration::from_millis(2),
            compute: Timing::ZERO,
            seed: 1,
            events_max: 100_000,
        }
    }

    /// The control period: `every` steps.
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

/// What happens to a process variable at an instant of the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Change {
    /// It becomes this.
    To(f64),
    /// It becomes what it is plus this.
    By(f64),
}
