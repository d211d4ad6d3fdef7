//! Touch-downs of all feet in one order.
//!
//! A detector is sure of a footstep when its impulse is enough, which is at another time after the
//! touch-down for each. Claims about the sequence of legs want the touch-downs by time, so those
//! that are sure wait here until no earlier one can come.

use twinrig_kernel::SimTime;

/// A foot touches down. Ordered by time, then by leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TouchDown {
    pub at: SimTime,
    /// Index of the leg.
    pub leg: usize,
}

/// So many may wait. A foot becomes a footstep or none in seconds, unless thresholds are set so
/// that a contact that hardly bears any load lasts without end.
const MOST: usize = 4096;

/// Merges the touch-downs of all feet.
#[derive(Clone, Debug)]
pub(crate) struct TouchDowns {
    /// Sorted.
    waiting: Vec<TouchDown>,
    /// Whether too many waited, so that there is no order any more.
    lost: bool,
}

impl TouchDowns {
    pub fn new() -> Self {
        TouchDowns {
            waiting: Vec::with_capacity(16),
            lost: false,
        }
    }

    /// Takes one that is sure.
    pub fn add(&mut self, touch_down: TouchDown) {
        if self.waiting.len() >= MOST {
            self.lost = true;
        }
        if !self.lost {
            let place = self.waiting.partition_point(|other| *other < touch_down);
            self.waiting.insert(place, touch_down);
        }
    }

    /// Gives the first, if it comes before `horizon`, which is before all that may still come.
    pub fn next_before(&mut self, horizon: TouchDown) -> Option<TouchDown> {
        let first = *self.waiting.first()?;
        if first >= horizon {
            return None;
        }
        Some(self.waiting.remove(0))
    }

    /// Those that wait, in their order.
    pub fn waiting(&self) -> &[TouchDown] {
        &self.waiting
    }

    /// Whether touch-downs are missing.
    pub fn is_lost(&self) -> bool {
        self.lost
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
    fn what_comes_late_is_put_in_its_place() {
        let mut merged = TouchDowns::new();
        for (nanos, leg) in [(5, 0), (3, 2), (3, 1), (9, 0)] {
            merged.add(touch_down(nanos, leg));
        }
        let mut given = Vec::new();
        while let Some(next) = merged.next_before(touch_down(9, 0)) {
            given.push((next.at.as_nanos(), next.leg));
        }
        assert_eq!(given, [(3, 1), (3, 2), (5, 0)]);
        assert_eq!(merged.waiting(), [touch_down(9, 0)]);
    }

    #[test]
    fn a_queue_that_never_moves_is_bounded_and_says_so() {
        let mut merged = TouchDowns::new();
        for nanos in 0..MOST as u64 {
            merged.add(touch_down(nanos, 0));
        }
        assert!(!merged.is_lost());
        for nanos in 0..100 {
            merged.add(touch_down(nanos, 1));
        }
        assert!(merged.is_lost());
        assert_eq!(merged.waiting().len(), MOST);
    }
}
