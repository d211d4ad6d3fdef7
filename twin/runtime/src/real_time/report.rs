use std::fmt;

use super::Histogram;
use crate::BusSummary;
use twinrig_kernel::SimDuration;

/// End of a real-time run without failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// The duration elapsed.
    Duration,
    /// A stop was requested.
    Stopped,
    /// The host closed its devices.
    HungUp,
}

/// Timing report of a real-time run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RealTimeReport {
    /// Time to open all drivers.
    pub opening: SimDuration,
    /// Iterations of the process.
    pub iterations: u64,
    /// Control steps missed because the last iteration was still running.
    pub overruns: u64,
    /// Control steps missed because the control thread was woken too late.
    pub overslept: u64,
    /// Delay of the control thread's wake-up after the control step.
    pub lateness: Histogram,
    /// Deviation of the interval between the beginnings of two iterations from the control period:
    /// [`twinrig_kernel::CycleJitter`]. An interval that includes missed control steps counts with
    /// its full length.
    pub jitter: Histogram,
    /// Compute time of the iterations.
    pub computing: Histogram,
    /// Reports of the tasks, in order.
    pub tasks: Vec<TaskReport>,
    /// Records lost because the observer's queue or a task's queue was full. A recording with such
    /// gaps is not reliable.
    pub lost: u64,
    /// Traffic of the buses, up to the order to close them.
    pub buses: Vec<BusSummary>,
}

/// Report on the transfers of a task.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TaskReport {
    /// Name of the task.
    pub name: String,
    /// Time from the end of the iteration to the end of the transfer.
    pub took: Histogram,
    /// Control steps at which it was busy, apart from those that follow from the periods.
    pub skipped: u64,
}

impl TaskReport {
    pub(super) fn of(name: &str) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }
}

/// Text of several lines for a terminal.
impl fmt::Display for RealTimeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.iterations == 0 {
            return writeln!(
                f,
                "no control step: the run ended while its devices were opened"
            );
        }
        writeln!(
            f,
            "{} iterations after {} of opening; {} control steps missed by the process, {} overslept",
            self.iterations, self.opening, self.overruns, self.overslept
        )?;
        writeln!(f, "waking later than the control step:\n{}", self.lateness)?;
        writeln!(f, "jitter from one iteration to the next:\n{}", self.jitter)?;
        writeln!(f, "computing:\n{}", self.computing)?;
        for task in &self.tasks {
            writeln!(
                f,
                "transfers of {}, {} times busy at a control step:\n{}",
                task.name, task.skipped, task.took
            )?;
        }
        if self.lost > 0 {
            writeln!(
                f,
                "LOST: {} records did not reach the observer, which was too slow for them",
                self.lost
            )?;
        }
        Ok(())
    }
}
