//! Wall-clock time of a run.

use std::time::Instant;

/// Wall-clock time since the start of a run, which its report contains. On a platform without a
/// clock it stays 0, and the report has no ratio of simulated time to wall time.
pub(crate) struct Stopwatch(Option<Instant>);

impl Stopwatch {
    #[expect(
        clippy::disallowed_methods,
        reason = "the report contains the wall time"
    )]
    pub(crate) fn start() -> Self {
        // WebAssembly without a host has no clock: the standard library would panic.
        let has_clock = !cfg!(all(target_family = "wasm", target_os = "unknown"));
        Self(has_clock.then(Instant::now))
    }

    pub(crate) fn elapsed_s(&self) -> f64 {
        self.0.map_or(0.0, |start| start.elapsed().as_secs_f64())
    }
}
