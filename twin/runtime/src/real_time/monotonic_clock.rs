//! The clock of the machine.

use twinrig_kernel::HostTime;

use super::clock::Clock;
use super::system;

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
