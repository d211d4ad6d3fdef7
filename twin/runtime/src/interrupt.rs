//! Request to end the program, as by Ctrl-C or SIGTERM: a global flag that is polled by every long
//! operation. The signal handler sets it by [`request`]; this crate installs none.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Requests the end; returns whether it had been requested before.
pub fn request() -> bool {
    REQUESTED.swap(true, Ordering::SeqCst)
}

/// Returns whether the end is requested.
#[inline]
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Returns the flag, to be polled by another thread.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Interruption check for a long loop.
///
/// A plant uses one in each [`crate::Plant::advance`] and checks it at every step: with steps of a
/// nanosecond, an advance to an observation a second away would take an hour without a possibility
/// of interruption.
///
/// ```
/// use twinrig_runtime::interrupt::LongLoop;
///
/// let mut steps = LongLoop::default();
/// let sum: u64 = (0..1_000_000).take_while(|_| !steps.is_interrupted()).sum();
/// assert_eq!(sum, 499_999_500_000);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct LongLoop {
    turns: u32,
}

/// Turns between two checks of the flag: an ordinary advance to the next observation has fewer and
/// is never interrupted.
const TURNS: u32 = 256;

impl LongLoop {
    /// Counts a turn; returns whether the end is requested, checked every 256th turn.
    #[inline]
    pub fn is_interrupted(&mut self) -> bool {
        self.is_interrupted_by(&REQUESTED)
    }

    #[inline]
    fn is_interrupted_by(&mut self, flag: &AtomicBool) -> bool {
        self.turns = self.turns.wrapping_add(1);
        self.turns.is_multiple_of(TURNS) && flag.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_loops_are_interrupted() {
        let flag = AtomicBool::new(true);
        let mut turns = LongLoop::default();
        let first = (1..=3 * TURNS).find(|_| turns.is_interrupted_by(&flag));
        assert_eq!(first, Some(TURNS));
        flag.store(false, Ordering::Relaxed);
        assert!((0..3 * TURNS).all(|_| !turns.is_interrupted_by(&flag)));
    }
}
