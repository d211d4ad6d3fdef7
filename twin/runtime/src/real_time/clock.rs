use std::time::Duration;

use nix::errno::Errno;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use twinrig_kernel::HostTime;

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

fn read_ns() -> u64 {
    // A system without this clock has no threads either.
    let reading = clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(Duration::ZERO, Duration::from);
    u64::try_from(reading.as_nanos()).unwrap_or(u64::MAX)
}

impl MonotonicClock {
    /// Creates a clock that is zero now.
    #[must_use]
    pub fn start() -> Self {
        Self {
            start_ns: read_ns(),
        }
    }
}

impl Clock for MonotonicClock {
    fn now(&self) -> HostTime {
        HostTime::from_nanos(read_ns().saturating_sub(self.start_ns))
    }

    fn sleep_until(&self, at: HostTime) {
        let until = TimeSpec::from(Duration::from_nanos(
            self.start_ns.saturating_add(at.as_nanos()),
        ));
        let absolute = ClockNanosleepFlags::TIMER_ABSTIME;
        // Sleep is resumed after a signal.
        while clock_nanosleep(ClockId::CLOCK_MONOTONIC, absolute, &until) == Err(Errno::EINTR) {}
    }
}
