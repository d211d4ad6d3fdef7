use std::fmt;

use super::Histogram;
use twinrig_kernel::SimDuration;

/// How a real-time run went, as far as time is concerned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RealTimeReport {
    /// How long the drivers took to open.
    pub opening: SimDuration,
    /// Iterations of the process.
    pub iterations: u64,
    /// Control steps missed because the process was still at its iteration.
    pub overruns: u64,
    /// Control steps missed because the control thread was not woken in time.
    pub overslept: u64,
    /// How much later than the control step the control thread woke.
    pub lateness: Histogram,
    /// By how much the intervals from the begin of one iteration to that of the next differed from the control period:
    /// [`twinrig_kernel::CycleJitter`]. One that spans control steps that were missed counts with all of its length.
    pub jitter: Histogram,
    /// How long the iterations took.
    pub computing: Histogram,
    /// The tasks, in order.
    pub tasks: Vec<TaskReport>,
    /// Records that the observer never saw: its queue was full, or a task's. A recording with such a hole in it
    /// is not to be trusted.
    pub lost: u64,
}

/// How the transfers of a task went.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TaskReport {
    /// The task.
    pub name: String,
    /// From the end of the iteration to the end of the transfer.
    pub took: Histogram,
    /// Control steps at which it was busy.
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

/// Some lines for a terminal.
impl fmt::Display for RealTimeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
