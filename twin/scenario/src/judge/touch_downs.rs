//! Merged touch-downs of all feet in temporal order.
//!
//! A footstep is confirmed when its impulse has reached the threshold, at a time after the
//! touch-down that differs between footsteps. Claims about the sequence of legs require touch-downs
//! in temporal order; confirmed ones are therefore queued until no earlier one can follow.

use twinrig_kernel::SimTime;

/// Touch-down of a foot; ordered by time, then by leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TouchDown {
    pub at: SimTime,
    /// Index of the leg.
    pub leg: usize,
}

/// Capacity of the queue. A contact is confirmed or rejected within seconds, unless the thresholds
/// allow an unlimited contact with little load.
const CAPACITY: usize = 4096;

/// Queue that merges the touch-downs of all feet.
#[derive(Clone, Debug)]
pub(crate) struct TouchDowns {
    /// Pending touch-downs, sorted.
    pending: Vec<TouchDown>,
    /// Whether the capacity was exceeded, so that the order is incomplete.
    overflowed: bool,
}

impl TouchDowns {
    pub fn new() -> Self {
        TouchDowns {
            pending: Vec::with_capacity(16),
            overflowed: false,
        }
    }

    /// Inserts a confirmed touch-down.
    pub fn add(&mut self, touch_down: TouchDown) {
        if self.pending.len() >= CAPACITY {
            self.overflowed = true;
        }
        if !self.overflowed {
            let place = self.pending.partition_point(|other| *other < touch_down);
            self.pending.insert(place, touch_down);
        }
    }

    /// Removes and returns the first touch-down if it is before `horizon`, the lower bound of all
    /// future ones.
    pub fn next_before(&mut self, horizon: TouchDown) -> Option<TouchDown> {
        let first = *self.pending.first()?;
        if first >= horizon {
            return None;
        }
        Some(self.pending.remove(0))
    }

    /// Returns the pending touch-downs in their order.
    pub fn pending(&self) -> &[TouchDown] {
        &self.pending
    }

    /// Returns whether touch-downs were dropped.
    pub fn has_overflowed(&self) -> bool {
        self.overflowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch_down(nanos: u64, leg: usize) -> TouchDown {
        let at = SimTime::from_nanos(nanos);
        TouchDown { at, leg }
    }

    #[test]
    fn late_touch_downs_are_sorted_in() {
        let mut merged = TouchDowns::new();
        for (nanos, leg) in [(5, 0), (3, 2), (3, 1), (9, 0)] {
            merged.add(touch_down(nanos, leg));
        }
        let mut released = Vec::new();
        while let Some(next) = merged.next_before(touch_down(9, 0)) {
            released.push((next.at.as_nanos(), next.leg));
        }
        assert_eq!(released, [(3, 1), (3, 2), (5, 0)]);
        assert_eq!(merged.pending(), [touch_down(9, 0)]);
    }

    #[test]
    fn blocked_queue_is_bounded_and_reports_the_overflow() {
        let mut merged = TouchDowns::new();
        for nanos in 0..CAPACITY as u64 {
            merged.add(touch_down(nanos, 0));
        }
        assert!(!merged.has_overflowed());
        for nanos in 0..100 {
            merged.add(touch_down(nanos, 1));
        }
        assert!(merged.has_overflowed());
        assert_eq!(merged.pending().len(), CAPACITY);
    }
}
