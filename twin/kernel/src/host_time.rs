use std::fmt;
use std::ops::{Add, Sub};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::SimDuration;
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

/// Saturates at the largest reading.
impl Add<SimDuration> for HostTime {
    type Output = Self;

    fn add(self, duration: SimDuration) -> Self {
        Self(self.0.saturating_add(duration.as_nanos()))
    }
}

/// Saturates at zero.
impl Sub<SimDuration> for HostTime {
    type Output = Self;

    fn sub(self, duration: SimDuration) -> Self {
        Self(self.0.saturating_sub(duration.as_nanos()))
    }
}

/// Saturates at the largest reading.
impl Add<Duration> for HostTime {
    type Output = Self;

    fn add(self, duration: Duration) -> Self {
        let nanos = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        Self(self.0.saturating_add(nanos))
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
