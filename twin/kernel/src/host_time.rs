use std::fmt;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::sim_time::write_nanos;

/// Reading of the clock of the host machine: nanoseconds since an instant chosen by the caller.
/// Only reports and the real-time executor read that clock, never the kernel; the separate type
/// keeps host time out of the results:
///
/// ```compile_fail,E0308
/// use twinrig_kernel::{HostTime, SimTime};
/// fn record(at: SimTime) {}
/// record(HostTime::from_nanos(5));
/// ```
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct HostTime(u64);

impl HostTime {
    /// The reading `nanos` \[ns\] after the caller's start.
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the caller's start.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Host time elapsed since `earlier`; zero if `earlier` is later (host clocks may step
    /// backwards).
    pub fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

impl fmt::Display for HostTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_nanos(f, self.0)
    }
}

impl fmt::Debug for HostTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_nanos(f, self.0)
    }
}
