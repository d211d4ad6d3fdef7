use std::fmt;
use std::ops::{Add, AddAssign, Div, Mul, Sub};

use serde::{Deserialize, Serialize};

/// Instant of physical time: whole nanoseconds since the start of the run.
///
/// Distinct from the reading of a board's clock ([`crate::LocalTime`]) and of the host's
/// ([`crate::HostTime`]); the three types cannot be mixed:
///
/// ```compile_fail,E0308
/// use twinrig_kernel::{LocalDuration, SimTime};
/// let later = SimTime::ZERO + LocalDuration::from_nanos(1);
/// ```
///
/// Nor can two instants be added:
///
/// ```compile_fail,E0308
/// use twinrig_kernel::SimTime;
/// let invalid = SimTime::ZERO + SimTime::ZERO;
/// ```
///
/// 64 bits cover 584 years. The operators panic on overflow and underflow in every build profile;
/// the `checked_` methods return `None`.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SimTime(u64);

/// Length of physical time in whole nanoseconds, never negative.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SimDuration(u64);

impl SimTime {
    /// The start of the run.
    pub const ZERO: Self = Self(0);
    /// The last representable instant.
    pub const MAX: Self = Self(u64::MAX);

    /// The instant `nanos` \[ns\] after the start.
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Whole nanoseconds since the start.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Seconds since the start, rounded to the nearest `f64`: for reports and phases, not for
    /// ordering.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Duration from the start to this instant.
    pub const fn since_start(self) -> SimDuration {
        SimDuration(self.0)
    }

    /// Returns the instant `duration` later, or `None` past the last representable one.
    pub fn checked_add(self, duration: SimDuration) -> Option<Self> {
        self.0.checked_add(duration.0).map(Self)
    }

    /// Returns the time since `earlier`, or `None` if `earlier` is later.
    pub fn checked_since(self, earlier: Self) -> Option<SimDuration> {
        self.0.checked_sub(earlier.0).map(SimDuration)
    }
}

impl SimDuration {
    /// Zero duration.
    pub const ZERO: Self = Self(0);
    /// The longest representable duration.
    pub const MAX: Self = Self(u64::MAX);

    /// A duration of `nanos` \[ns\].
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// A duration of `micros` \[µs\].
    ///
    /// # Panics
    /// Past 584 years.
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros.checked_mul(1_000).expect("duration past 584 years"))
    }

    /// A duration of `millis` \[ms\].
    ///
    /// # Panics
    /// Past 584 years.
    pub const fn from_millis(millis: u64) -> Self {
        Self(
            millis
                .checked_mul(1_000_000)
                .expect("duration past 584 years"),
        )
    }

    /// A duration of `secs` \[s\].
    ///
    /// # Panics
    /// Past 584 years.
    pub const fn from_secs(secs: u64) -> Self {
        Self(
            secs.checked_mul(1_000_000_000)
                .expect("duration past 584 years"),
        )
    }

    /// Rounds `secs` \[s\] to the nearest nanosecond; `None` if negative, NaN or past the longest
    /// duration.
    pub fn try_from_secs_f64(secs: f64) -> Option<Self> {
        let nanos = libm::round(secs * 1e9);
        // 2⁶⁴, exact in `f64`: the first value that does not fit.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the range is checked"
        )]
        (0.0..18_446_744_073_709_551_616.0)
            .contains(&nanos)
            .then_some(Self(nanos as u64))
    }

    /// Whole nanoseconds.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// Seconds, rounded to the nearest `f64`.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Whether the duration is zero.
    pub const fn is_zero(self) -> bool {
        self.0 == 0
    }

    /// Returns the sum, or `None` past the longest duration.
    pub fn checked_add(self, other: Self) -> Option<Self> {
        self.0.checked_add(other.0).map(Self)
    }

    /// Returns the difference, or `None` if it would be negative.
    pub fn checked_sub(self, other: Self) -> Option<Self> {
        self.0.checked_sub(other.0).map(Self)
    }

    /// Returns the product, or `None` past the longest duration.
    pub fn checked_mul(self, times: u64) -> Option<Self> {
        self.0.checked_mul(times).map(Self)
    }

    /// Whether this duration is an integer multiple of `step`; false if `step` is zero.
    pub fn is_multiple_of(self, step: Self) -> bool {
        step.0 != 0 && self.0.is_multiple_of(step.0)
    }
}

// Inlined into the run loops of other crates: they check, which is too long by the compiler's rule.
impl Add<SimDuration> for SimTime {
    type Output = Self;
    #[inline]
    fn add(self, duration: SimDuration) -> Self {
        self.checked_add(duration)
            .expect("simulated time past 584 years")
    }
}

impl AddAssign<SimDuration> for SimTime {
    #[inline]
    fn add_assign(&mut self, duration: SimDuration) {
        *self = *self + duration;
    }
}

impl Sub for SimTime {
    type Output = SimDuration;
    #[inline]
    fn sub(self, earlier: Self) -> SimDuration {
        self.checked_since(earlier)
            .expect("difference of two instants in the wrong order")
    }
}

impl Add for SimDuration {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.checked_add(other).expect("duration past 584 years")
    }
}

impl AddAssign for SimDuration {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for SimDuration {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.checked_sub(other)
            .expect("a duration cannot be negative")
    }
}

impl Mul<u64> for SimDuration {
    type Output = Self;
    #[inline]
    fn mul(self, times: u64) -> Self {
        self.checked_mul(times).expect("duration past 584 years")
    }
}

impl Div<u64> for SimDuration {
    type Output = Self;
    /// Rounds down to the nanosecond.
    #[inline]
    fn div(self, parts: u64) -> Self {
        Self(self.0 / parts)
    }
}

/// Writes `nanos` exactly, in the largest unit not above it, with 3, 6 or 9 decimals.
pub(crate) fn write_nanos(f: &mut fmt::Formatter<'_>, nanos: u64) -> fmt::Result {
    let (per_unit, digits, unit) = match nanos {
        0..1_000 => return f.pad(&format!("{nanos} ns")),
        1_000..1_000_000 => (1_000, 3, "µs"),
        1_000_000..1_000_000_000 => (1_000_000, 6, "ms"),
        _ => (1_000_000_000, 9, "s"),
    };
    let mut fraction = format!("{:0digits$}", nanos % per_unit);
    while fraction.len() > 3 && fraction.ends_with("000") {
        fraction.truncate(fraction.len() - 3);
    }
    f.pad(&format!("{}.{fraction} {unit}", nanos / per_unit))
}

macro_rules! show_as_nanos {
    ($($type:ty),*) => {$(
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write_nanos(f, self.0)
            }
        }
        impl fmt::Debug for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write_nanos(f, self.0)
            }
        }
    )*};
}
show_as_nanos!(SimTime, SimDuration);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn display_is_exact_and_short() {
        for (nanos, text) in [
            (0, "0 ns"),
            (999, "999 ns"),
            (1_250_000, "1.250 ms"),
            (1_250_001, "1.250001 ms"),
            (8_000_000_000, "8.000 s"),
            (8_000_001_000, "8.000001 s"),
            (125_000, "125.000 µs"),
        ] {
            assert_eq!(SimDuration::from_nanos(nanos).to_string(), text);
        }
    }

    #[test]
    fn seconds_are_rounded_and_invalid_values_rejected() {
        assert_eq!(
            SimDuration::try_from_secs_f64(0.002),
            Some(SimDuration::from_millis(2))
        );
        assert_eq!(
            SimDuration::try_from_secs_f64(0.1 + 0.2),
            Some(SimDuration::from_millis(300))
        );
        for invalid in [-1e-9, f64::NAN, f64::INFINITY, 1e11] {
            assert_eq!(SimDuration::try_from_secs_f64(invalid), None, "{invalid}");
        }
    }

    #[test]
    #[should_panic(expected = "wrong order")]
    fn subtracting_a_later_instant_panics() {
        let _ = SimTime::ZERO - SimTime::from_nanos(1);
    }
}
