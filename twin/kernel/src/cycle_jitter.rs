use crate::{SimDuration, SimTime};

/// The jitter of a cycle: by how much each interval from one begin to the next differs from the period. This is
/// the definition for reports and expectations alike.
///
/// An interval counts with all of its length, so a cycle that leaves periods out has their length as its jitter.
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
    /// Of a cycle of that period, which has not begun yet.
    pub const fn new(period: SimDuration) -> Self {
        Self { period, last: None }
    }

    /// The cycle begins at `now`, which is not before the last begin: the jitter of the interval since then; None for
    /// the first begin.
    pub fn begin(&mut self, now: SimTime) -> Option<SimDuration> {
        let last = self.last.replace(now)?;
        let off = (now - last).as_nanos().abs_diff(self.period.as_nanos());
        Some(SimDuration::from_nanos(off))
    }

    /// The least jitter that the interval under way can have, if it has not ended by `now`; None before the first begin.
    pub fn at_least(&self, now: SimTime) -> Option<SimDuration> {
        let lasted = (now - self.last?).as_nanos();
        let over = lasted.saturating_sub(self.period.as_nanos());
        Some(SimDuration::from_nanos(over))
    }
}
