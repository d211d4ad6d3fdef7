//! The clock of the machine. It says what a run costs and when to give one up; no result is made of it.
#![expect(
    clippy::disallowed_methods,
    reason = "run times are what a study reports, and nothing but run times is made of them"
)]

use std::time::{Duration, Instant};

use twinrig_runtime::interrupt;

/// Time since it was started.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch(Instant);

/// A time to be done by.
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
    /// In `seconds` from now; what cannot be counted never comes.
    pub(crate) fn within(seconds: f64) -> Self {
        let duration = Duration::try_from_secs_f64(seconds.max(0.0)).ok();
        Self(duration.and_then(|duration| Instant::now().checked_add(duration)))
    }

    /// Whether it is time: also if the program is to end, and the study with it.
    pub(crate) fn passed(self) -> bool {
        interrupt::is_requested() || self.0.is_some_and(|at| Instant::now() >= at)
    }
}
