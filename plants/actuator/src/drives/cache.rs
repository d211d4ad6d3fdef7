//! Cache of responses by step length: boards tick at a few recurring distances. An entry depends on
//! the length alone, so that results do not depend on the cache's history.

use twinrig_kernel::SimDuration;

use super::shaft::{Responses, ShaftModel};

/// Number of entries; an entry's index is the length modulo this number.
const ENTRIES: usize = 64;

#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    /// Length of the step \[ns\]; zero for an empty entry, since no step has that length.
    nanos: u64,
    seconds: f64,
    responses: [Responses; 2],
}

/// Cache for the two kinds of shafts.
#[derive(Debug, Clone)]
pub(crate) struct Cache {
    entries: Box<[Entry; ENTRIES]>,
}

impl Cache {
    pub(crate) fn new() -> Self {
        Self {
            entries: Box::new([Entry::default(); ENTRIES]),
        }
    }

    /// Returns a step's length in seconds, and the response of each kind of shaft.
    pub(crate) fn find(
        &mut self,
        step: SimDuration,
        models: &[ShaftModel; 2],
    ) -> (f64, &[Responses; 2]) {
        let nanos = step.as_nanos();
        let index = usize::try_from(nanos % ENTRIES as u64).unwrap_or_default();
        let entry = &mut self.entries[index];
        if entry.nanos != nanos {
            let seconds = step.as_secs_f64();
            let hip = models[0].responses(seconds);
            let knee = if models[1] == models[0] {
                hip
            } else {
                models[1].responses(seconds)
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
