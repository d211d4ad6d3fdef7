//! Wall clock of the machine: run times and deadlines. No other result depends on it.
#![expect(
    clippy::disallowed_methods,
    reason = "run times and deadlines only; no other result depends on the clock"
)]

use std::time::{Duration, Instant};

use twinrig_runtime::interrupt;

/// Elapsed time since the start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch(Instant);

/// Deadline of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deadline(Option<Instant>);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    /// \[s\]
    pub(crate) fn elapsed_s(self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

impl Deadline {
    /// A deadline `seconds` from now; none if the instant is not representable.
    pub(crate) fn within(seconds: f64) -> Self {
        let duration = Duration::try_from_secs_f64(seconds.max(0.0)).ok();
        Self(duration.and_then(|duration| Instant::now().checked_add(duration)))
    }

    /// Returns whether the deadline has passed, or the termination of the program was requested.
    pub(crate) fn passed(self) -> bool {
        interrupt::is_requested() || self.0.is_some_and(|at| Instant::now() >= at)
    }
}
