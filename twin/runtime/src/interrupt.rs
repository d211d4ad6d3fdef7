//! The request to end, which Ctrl-C or a plain kill makes: a flag of the whole program, at which everything looks that may
//! take long. Who catches signals sets it ([`request`]); nothing here does.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Requests the end; says whether that had been requested before.
pub fn request() -> bool {
    REQUESTED.swap(true, Ordering::SeqCst)
}

/// Whether the end is requested.
#[inline]
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// The flag itself, for another thread to look at.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Tells a loop that may take long when to end.
///
/// A plant has one in each [`crate::Plant::advance`] and asks it at every step: steps of a nanosecond to an observation a second
/// away would take an hour, in which a program could not be interrupted.
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

/// So many turns are never interrupted: an ordinary advance to the next observation ends where it should.
const TURNS: u32 = 256;

impl LongLoop {
    /// Whether the loop has turned often, and the end is requested.
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
    fn a_short_loop_is_not_interrupted_and_a_long_one_is() {
        let flag = AtomicBool::new(true);
        let mut turns = LongLoop::default();
        let first = (1..=3 * TURNS).find(|_| turns.is_interrupted_by(&flag));
        assert_eq!(first, Some(TURNS));
        flag.store(false, Ordering::Relaxed);
        assert!((0..3 * TURNS).all(|_| !turns.is_interrupted_by(&flag)));
    }
}
