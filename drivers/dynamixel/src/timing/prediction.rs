use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use super::adapters::adapters;
use super::host_loop::{HostLoop, LoopError};
use super::statistics::percentile;

/// Return delays of the rows.
pub const RETURN_DELAYS: [SimDuration; 5] = [
    SimDuration::ZERO,
    SimDuration::from_micros(20),
    SimDuration::from_micros(100),
    SimDuration::from_micros(250),
    SimDuration::from_micros(500),
];
/// Times by which a sleep is too long: none; the default slack of Linux's timers (prctl(2),
/// `PR_SET_TIMERSLACK`); the same with a wake-up of 50 µs, ASSUMED.
pub const SLACKS: [SimDuration; 3] = [
    SimDuration::ZERO,
    SimDuration::from_micros(50),
    SimDuration::from_micros(100),
];
/// Sleep of the loop with torque.
const SLEEP: SimDuration = SimDuration::from_millis(1);
/// Periods of which a row has the median.
const PERIODS: usize = 61;

/// Median periods of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopTimes {
    /// Without torque: five reads.
    pub without_torque: SimDuration,
    /// With torque: a write, a sleep and five reads.
    pub with_torque: SimDuration,
}

/// Predicted periods of a loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prediction {
    /// Name of the adapter.
    pub adapter: &'static str,
    /// Return delay of the servo.
    pub return_delay: SimDuration,
    /// Time by which the program oversleeps.
    pub slack: SimDuration,
    /// Medians.
    pub times: LoopTimes,
}

impl LoopTimes {
    /// Returns the time of write and sleep.
    pub fn write_and_sleep(&self) -> SimDuration {
        self.with_torque
            .checked_sub(self.without_torque)
            .unwrap_or_default()
    }
}

impl Prediction {
    /// Returns the relative deviations from measured times: without torque, with torque, write and
    /// sleep.
    pub fn deviations(&self, measured: &LoopTimes) -> [f64; 3] {
        let of = |times: &LoopTimes| {
            let all = [
                times.without_torque,
                times.with_torque,
                times.write_and_sleep(),
            ];
            all.map(SimDuration::as_secs_f64)
        };
        let (found, measured) = (of(&self.times), of(measured));
        std::array::from_fn(|n| found[n] / measured[n] - 1.0)
    }

    /// Whether all three are at most `tolerance`.
    pub fn agrees(&self, measured: &LoopTimes, tolerance: f64) -> bool {
        let deviations = self.deviations(measured);
        deviations.iter().all(|it| it.abs() <= tolerance)
    }
}

/// Returns the predictions for all adapters, return delays and slacks, in this order. They are
/// computed by [`HostLoop`], with no time of the program.
///
/// # Errors
/// [`LoopError`] if a loop cannot be run.
pub fn predictions() -> Result<Vec<Prediction>, LoopError> {
    let mut rows = Vec::new();
    for adapter in adapters() {
        for return_delay in RETURN_DELAYS {
            let median = |sleep| {
                let host = HostLoop {
                    usb: adapter.usb.clone(),
                    return_delay,
                    sleep,
                    program: Timing::ZERO,
                    seed: 1,
                };
                Ok::<_, LoopError>(percentile(&mut host.periods(PERIODS)?, 50))
            };
            let without_torque = median(None)?;
            for slack in SLACKS {
                rows.push(Prediction {
                    adapter: adapter.name,
                    return_delay,
                    slack,
                    times: LoopTimes {
                        without_torque,
                        with_torque: median(Some(SLEEP + slack))?,
                    },
                });
            }
        }
    }
    Ok(rows)
}
