use std::time::Duration;

use nix::errno::Errno;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use twinrig_kernel::HostTime;

/// What the real-time executors know of time. The one that counts is [`MonotonicClock`]; tests have one that
/// they wind themselves.
pub trait Clock: Send + Sync {
    /// What time it is.
    fn now(&self) -> HostTime;

    /// Returns at that instant or later; at once if it is past.
    fn sleep_until(&self, at: HostTime);
}

/// The machine's monotonic clock, from the instant at which this was made on. Sleeps absolutely, so that the
/// time between looking at it and going to sleep does not add up.
#[derive(Clone, Copy, Debug)]
pub struct MonotonicClock {
    start_ns: u64,
}

fn read_ns() -> u64 {
    // A kernel without this clock has no threads either.
    let reading = clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(Duration::ZERO, Duration::from);
    u64::try_from(reading.as_nanos()).unwrap_or(u64::MAX)
}

impl MonotonicClock {
    /// A clock that shows zero now.
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
        // A signal interrupts sleep; that is no reason to begin early.
        while clock_nanosleep(ClockId::CLOCK_MONOTONIC, absolute, &until) == Err(Errno::EINTR) {}
    }
}

/// The instant `after` later.
pub(super) fn later(at: HostTime, after: Duration) -> HostTime {
    let after_ns = u64::try_from(after.as_nanos()).unwrap_or(u64::MAX);
    HostTime::from_nanos(at.as_nanos().saturating_add(after_ns))
}
