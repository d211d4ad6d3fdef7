//! Polls of Python's signals from long operations.
#![expect(
    clippy::disallowed_methods,
    reason = "the time between two polls; no result depends on it"
)]

use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Poll of Python's signals at most once in a period of wall time: to attach to the interpreter may
/// wait for another of its threads.
pub(crate) struct Poll {
    period: Duration,
    last: Instant,
}

impl Poll {
    pub(crate) fn new(period: Duration) -> Self {
        Self {
            period,
            last: Instant::now(),
        }
    }

    /// Returns whether a poll is due.
    pub(crate) fn is_due(&mut self) -> bool {
        let is_due = self.last.elapsed() >= self.period;
        if is_due {
            self.last = Instant::now();
        }
        is_due
    }

    /// Runs the handlers of Python's signals, if a poll is due.
    pub(crate) fn signals(&mut self, py: Python<'_>) -> PyResult<()> {
        if self.is_due() { py.check_signals() } else { Ok(()) }
    }
}
