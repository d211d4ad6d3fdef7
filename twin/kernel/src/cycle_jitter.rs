use crate::{SimDuration, SimTime};

/// Jitter of a cycle: absolute difference between each begin-to-begin interval and the period.
/// Reports and expectations use this one definition.
///
/// An interval counts at its full length; the jitter of a cycle that skips periods is therefore the
/// length of the skipped periods.
///
/// ```
/// use twinrig_kernel::{CycleJitter, SimDuration, SimTime};
///
/// let millis = |n| SimTime::ZERO + SimDuration::from_millis(n);
/// let mut jitter = CycleJitter::new(SimDuration::from_millis(4));
/// assert_eq!(jitter.begin(millis(0)), None);
/// assert_eq!(jitter.begin(millis(4)), Some(SimDuration::ZERO));
/// assert_eq!(jitter.begin(millis(1_004)), Some(SimDuration::from_millis(996)));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CycleJitter {
    period: SimDuration,
    last: Option<SimTime>,
}

impl CycleJitter {
    /// The jitter of a cycle with that period, before the first begin.
    pub const fn new(period: SimDuration) -> Self {
        Self { period, last: None }
    }

    /// Records a begin at `now`, which must not precede the last one, and returns the jitter of the
    /// interval since then; `None` for the first begin.
    pub fn begin(&mut self, now: SimTime) -> Option<SimDuration> {
        let last = self.last.replace(now)?;
        let off = (now - last).as_nanos().abs_diff(self.period.as_nanos());
        Some(SimDuration::from_nanos(off))
    }

    /// Returns a lower bound of the jitter of the current interval, which has not ended by `now`;
    /// `None` before the first begin.
    pub fn at_least(&self, now: SimTime) -> Option<SimDuration> {
        let lasted = (now - self.last?).as_nanos();
        let over = lasted.saturating_sub(self.period.as_nanos());
        Some(SimDuration::from_nanos(over))
    }
}
