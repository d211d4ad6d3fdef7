//! Responses to steps of lengths that come again: boards tick at a few distances from each other. Only a cache: what is in it
//! depends on the length alone, so that nothing else does on what is in it.

use twinrig_kernel::SimDuration;

use crate::shaft::{Fixture, Responses};

/// Lengths that are kept, each at the place that its last bits say.
const KEPT: usize = 64;

#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    /// Length of the step \[ns\]; zero for none, since no step is that short.
    nanos: u64,
    seconds: f64,
    responses: [Responses; 2],
}

/// The cache, for the two kinds of shafts.
#[derive(Debug, Clone)]
pub(crate) struct Cache {
    entries: Box<[Entry; KEPT]>,
}

impl Cache {
    pub(crate) fn new() -> Self {
        Self {
            entries: Box::new([Entry::default(); KEPT]),
        }
    }

    /// A step's length in seconds, and how each kind of shaft responds.
    pub(crate) fn find(
        &mut self,
        step: SimDuration,
        fixtures: &[Fixture; 2],
    ) -> (f64, &[Responses; 2]) {
        let nanos = step.as_nanos();
        let place = usize::try_from(nanos % KEPT as u64).unwrap_or_default();
        let entry = &mut self.entries[place];
        if entry.nanos != nanos {
            let seconds = step.as_secs_f64();
            let hip = fixtures[0].responses(seconds);
            let knee = if fixtures[1] == fixtures[0] {
                hip
            } else {
                fixtures[1].responses(seconds)
            };
            *entry = Entry {
                nanos,
                seconds,
                responses: [hip, knee],
            };
        }
        (entry.seconds, &entry.responses)
    }
}
