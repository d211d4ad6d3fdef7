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

/// Resolution of the clocks \[s\].
const RESOLUTION_S: f64 = 1e-9;

/// Wall clock that does not count the time for which this thread waited for a processor, where the
/// system reports it: other programs then affect a run time by caches and frequency only.
#[derive(Clone, Copy, Debug)]
pub struct RunStopwatch {
    wall: Stopwatch,
    waited_s: f64,
}

impl RunStopwatch {
    /// Starts a stopwatch of this thread.
    pub fn start() -> Self {
        // The wall clock starts before and stops after the count of waiting time, which is thereby
        // a part of the wall time, also where the thread waits between the two.
        let wall = Stopwatch::start();
        Self {
            wall,
            waited_s: waited_s(),
        }
    }

    /// Returns the time since the start \[s\].
    pub fn elapsed_s(self) -> f64 {
        let waited_s = waited_s() - self.waited_s;
        // The two are of different clocks.
        (self.wall.elapsed_s() - waited_s).max(RESOLUTION_S)
    }
}

/// Returns the time for which this thread has waited for a processor; zero where the system does
/// not report it \[s\].
fn waited_s() -> f64 {
    let report = std::fs::read_to_string("/proc/thread-self/schedstat");
    parse_waited_s(&report.unwrap_or_default()).unwrap_or(0.0)
}

/// Parses run time, waiting time (both in nanoseconds) and number of time slices.
fn parse_waited_s(report: &str) -> Option<f64> {
    let nanos: f64 = report.split_whitespace().nth(1)?.parse().ok()?;
    Some(nanos / 1e9)
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_time_is_the_second_field() {
        assert_eq!(parse_waited_s("354761 15030181 2\n"), Some(0.015_030_181));
        assert_eq!(parse_waited_s(""), None);
    }

    #[test]
    fn run_time_is_at_most_that_of_the_wall_clock() {
        let (wall, run) = (Stopwatch::start(), RunStopwatch::start());
        while wall.elapsed_s() < 0.02 {
            std::hint::spin_loop();
        }
        let elapsed_s = run.elapsed_s();
        assert!(
            (RESOLUTION_S..=wall.elapsed_s()).contains(&elapsed_s),
            "{elapsed_s}"
        );
    }
}
