//! In place of `system` where there is no Linux: real time is refused before a run, so that nothing
//! here is waited for.

use std::time::Duration;

use twinrig_kernel::HostTime;

use super::clock::Clock;
use crate::{Device, RigError};

/// Returns whether this system has real time: it does not.
pub(super) fn check() -> Result<(), RigError> {
    Err(RigError::NeedsLinux)
}

/// Returns zero: no clock runs.
pub(super) fn monotonic_ns() -> u64 {
    0
}

/// Returns at once.
pub(super) fn sleep_until_ns(_until: u64) {}

/// Returns that no memory is locked.
pub(super) fn lock_memory() -> bool {
    false
}

/// Returns whether no priority is wanted: none is granted.
pub(super) fn raise_priority(priority: Option<u8>) -> bool {
    priority.is_none()
}

/// Devices that are waited for together: none.
#[derive(Default)]
pub(super) struct Watched;

impl Watched {
    /// Returns that the system cannot wait for a device.
    pub(super) fn add(&mut self, _device: &dyn Device) -> bool {
        false
    }

    /// Waits by the clock.
    pub(super) fn wait(self, begin: HostTime, timeout: Duration, clock: &dyn Clock) {
        clock.sleep_until(begin + timeout);
    }
}
