use twinrig_kernel::HostTime;

use super::system;

/// Clock of the real-time executors: [`MonotonicClock`], or a manual one in tests.
pub trait Clock: Send + Sync {
    /// Returns the present time.
    fn now(&self) -> HostTime;

    /// Blocks until `at` or later; returns immediately if `at` is past.
    fn sleep_until(&self, at: HostTime);
}

/// The machine's monotonic clock, with zero at its creation. Sleeps until absolute times, so that
/// the time between reading and sleeping does not accumulate.
#[derive(Clone, Copy, Debug)]
pub struct MonotonicClock {
    start_ns: u64,
}

impl MonotonicClock {
    /// Creates a clock that is zero now.
    #[must_use]
    pub fn start() -> Self {
        Self {
            start_ns: system::monotonic_ns(),
        }
    }
}

impl Clock for MonotonicClock {
    fn now(&self) -> HostTime {
        HostTime::from_nanos(system::monotonic_ns().saturating_sub(self.start_ns))
    }

    fn sleep_until(&self, at: HostTime) {
        system::sleep_until_ns(self.start_ns.saturating_add(at.as_nanos()));
    }
}
