//! Polls of Python's signals from long operations.
#![expect(
    clippy::disallowed_methods,
    reason = "the time between two polls; no result depends on it"
)]

use std::time::{Duration, Instant};

use pyo3::prelude::*;
use twinrig::runtime::interrupt;

use crate::exceptions::Exceptions;

/// Wall time between two polls of Python's signals.
pub(crate) const PERIOD: Duration = Duration::from_millis(50);

/// Poll of Python's signals at most once in a period of wall time: to attach to the interpreter may
/// wait for another of its threads.
pub(crate) struct Poll {
    last: Instant,
}

impl Poll {
    pub(crate) fn new() -> Self {
        let last = Instant::now();
        Self { last }
    }

    fn is_due(&mut self) -> bool {
        let is_due = self.last.elapsed() >= PERIOD;
        if is_due {
            self.last = Instant::now();
        }
        is_due
    }

    /// Runs the handlers of Python's signals, if a poll is due.
    pub(crate) fn signals(&mut self, py: Python<'_>) -> PyResult<()> {
        if self.is_due() {
            py.check_signals()
        } else {
            Ok(())
        }
    }
}

/// Poll from a run: an exception of a signal handler requests the end of the run.
pub(crate) struct SignalPoll<'a> {
    poll: Poll,
    exceptions: &'a Exceptions,
}

impl<'a> SignalPoll<'a> {
    pub(crate) fn new(exceptions: &'a Exceptions) -> Self {
        let poll = Poll::new();
        Self { poll, exceptions }
    }

    /// Polls, if a poll is due.
    pub(crate) fn poll(&mut self) {
        if !self.poll.is_due() {
            return;
        }
        Python::attach(|py| {
            if let Err(raised) = py.check_signals() {
                self.exceptions.keep(py, raised);
                if let Some(token) = interrupt::current() {
                    token.request();
                }
            }
        });
    }
}
