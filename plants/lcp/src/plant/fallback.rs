//! Length of the fallbacks to Moreau's rule where events accumulate.

/// Initial and maximum number of steps of a fallback. An attempt without it costs about as much as
/// ten of its steps.
const BACKOFF: u32 = 25;
const BACKOFF_MAX: u32 = 200;

/// Steps of a fallback, doubled at each recurrence.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fallback {
    /// Remaining steps of the present fallback.
    pub(super) remaining: u32,
    /// Length of the next one.
    pub(super) backoff: u32,
    /// Steps since the last one.
    pub(super) steps_since: u32,
}

impl Fallback {
    pub(super) fn new() -> Self {
        Self {
            remaining: 0,
            backoff: BACKOFF,
            steps_since: 0,
        }
    }

    /// Starts a fallback of `backoff` steps, and doubles the length of the next one.
    pub(super) fn begin(&mut self) {
        self.remaining = self.backoff;
        self.backoff = (2 * self.backoff).min(BACKOFF_MAX);
        self.steps_since = 0;
    }

    /// Returns whether a step is the first one after a fallback.
    pub(super) fn has_just_ended(&self) -> bool {
        self.backoff > BACKOFF && self.steps_since == 0
    }

    /// Counts a step without fallback. Halves the length of the next one after as many of them.
    pub(super) fn count_step(&mut self) {
        self.steps_since += 1;
        if self.steps_since.is_multiple_of(self.backoff) {
            self.backoff = (self.backoff / 2).max(BACKOFF);
        }
    }
}
