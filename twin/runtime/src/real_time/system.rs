//! System calls of real time: Linux, with its clocks, priorities and polling.

use std::time::Duration;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::prctl::set_timerslack;
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use twinrig_kernel::HostTime;

use super::clock::Clock;
use crate::{Device, RigError};

/// Returns whether this system has real time: it does.
#[expect(clippy::unnecessary_wraps, reason = "other systems refuse")]
pub(super) fn check() -> Result<(), RigError> {
    Ok(())
}

/// Returns the time of the monotonic clock \[ns\].
pub(super) fn monotonic_ns() -> u64 {
    // A system without this clock has no threads either.
    let reading = clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(Duration::ZERO, Duration::from);
    u64::try_from(reading.as_nanos()).unwrap_or(u64::MAX)
}

/// Sleeps until a time of the monotonic clock \[ns\].
pub(super) fn sleep_until_ns(until: u64) {
    let until = TimeSpec::from(Duration::from_nanos(until));
    let absolute = ClockNanosleepFlags::TIMER_ABSTIME;
    // Sleep is resumed after a signal.
    while clock_nanosleep(ClockId::CLOCK_MONOTONIC, absolute, &until) == Err(Errno::EINTR) {}
}

/// Locks present memory, and future memory if its amount is unlimited: with a limit
/// allocations could fail, which ends a program.
pub(super) fn lock_memory() -> bool {
    let unlimited =
        getrlimit(Resource::RLIMIT_MEMLOCK).is_ok_and(|(soft, _)| soft == RLIM_INFINITY);
    let mut flags = MlockAllFlags::MCL_CURRENT;
    if unlimited {
        flags |= MlockAllFlags::MCL_FUTURE;
    }
    mlockall(flags).is_ok()
}

/// Sets the calling thread's real-time priority and minimum timer slack; returns whether the
/// priority is set.
pub(super) fn raise_priority(priority: Option<u8>) -> bool {
    // The default timer slack of normal threads is 50 µs, to save power.
    let _ = set_timerslack(1);
    let Some(priority) = priority else {
        return true;
    };
    let Ok(priority) = ThreadPriority::try_from(priority) else {
        return false;
    };
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), priority, policy).is_ok()
}

/// Devices that are waited for together.
#[derive(Default)]
pub(super) struct Watched<'a>(Vec<PollFd<'a>>);

impl<'a> Watched<'a> {
    /// Adds a device; returns whether the system can wait for it.
    pub(super) fn add(&mut self, device: &'a dyn Device) -> bool {
        let descriptor = device.descriptor();
        let polled = descriptor.map(|descriptor| PollFd::new(descriptor, PollFlags::POLLIN));
        let can_wait = polled.is_some();
        self.0.extend(polled);
        can_wait
    }

    /// Waits for bytes at any of them, from `begin` for `timeout`.
    pub(super) fn wait(mut self, begin: HostTime, timeout: Duration, clock: &dyn Clock) {
        if self.0.is_empty() {
            clock.sleep_until(begin + timeout);
        } else {
            // All devices are read next, whatever ended the wait.
            let _ = ppoll(&mut self.0, Some(TimeSpec::from(timeout)), None);
        }
    }
}
