use std::fmt;
use std::ops::{Add, Sub};

use serde::{Deserialize, Serialize};

use crate::sim_time::write_nanos;

/// Reading of a board's clock \[ns\]. It may be negative, because the zero of a board is arbitrary.
///
/// Only the board's [`crate::BoardClock`] converts it to physical time:
///
/// ```compile_fail,E0308
/// use twinrig_kernel::{LocalTime, SimTime};
/// let same = SimTime::ZERO == LocalTime::from_nanos(0);
/// ```
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LocalTime(i64);

/// Difference of two readings of one board's clock \[ns\]; it may be negative.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LocalDuration(i64);

impl LocalTime {
    /// The reading `nanos` \[ns\].
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds on the board's clock.
    pub const fn as_nanos(self) -> i64 {
        self.0
    }
}

impl LocalDuration {
    /// Zero duration.
    pub const ZERO: Self = Self(0);

    /// A duration of `nanos` \[ns\] on the board's clock.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds on the board's clock.
    pub const fn as_nanos(self) -> i64 {
        self.0
    }
}

impl Add<LocalDuration> for LocalTime {
    type Output = Self;
    fn add(self, duration: LocalDuration) -> Self {
        Self(
            self.0
                .checked_add(duration.0)
                .expect("local time past 292 years"),
        )
    }
}

impl Sub for LocalTime {
    type Output = LocalDuration;
    fn sub(self, other: Self) -> LocalDuration {
        LocalDuration(
            self.0
                .checked_sub(other.0)
                .expect("local duration past 292 years"),
        )
    }
}

macro_rules! show_signed_nanos {
    ($($type:ty),*) => {$(
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                if self.0 < 0 {
                    f.write_str("-")?;
                }
                write_nanos(f, self.0.unsigned_abs())
            }
        }
        impl fmt::Debug for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }
    )*};
}
show_signed_nanos!(LocalTime, LocalDuration);
