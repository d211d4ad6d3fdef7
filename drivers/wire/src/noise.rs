use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Stream};

use crate::arrivals::Octet;
use crate::{Arrivals, Fault, FaultKind};

/// Spurious bytes of a line held low or of a babbling station. Generated in blocks, each at its
/// start.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Noise {
    stream: Stream,
    /// For each fault, the start of its next block; None if it generates no noise or has ended.
    next: Vec<Option<SimTime>>,
    /// End of the last block.
    pub(crate) until: SimTime,
}

/// Maximum number of bytes in a block.
const BLOCK: u64 = 64;

impl Noise {
    pub(crate) fn new(faults: &[Fault], babbles: bool, stream: Stream) -> Self {
        let noisy = |fault: &Fault| match fault.kind {
            FaultKind::Stuck => true,
            FaultKind::Babble { .. } => babbles,
            _ => false,
        };
        let next = faults.iter().map(|fault| noisy(fault).then_some(fault.at));
        Self {
            stream,
            next: next.collect(),
            until: SimTime::ZERO,
        }
    }

    /// Returns the start of the next block.
    pub(crate) fn next_block(&self) -> Option<SimTime> {
        self.next.iter().flatten().min().copied()
    }

    /// Appends the next block, starting not before `after`; returns the index of its fault
    /// and its number of bytes.
    pub(crate) fn block(
        &mut self,
        faults: &[Fault],
        byte_time: SimDuration,
        after: SimTime,
        out: &mut Arrivals,
    ) -> (usize, u64) {
        let earliest = (0..self.next.len()).filter(|n| self.next[*n].is_some());
        let Some(index) = earliest.min_by_key(|n| self.next[*n]) else {
            return (0, 0);
        };
        let fault = &faults[index];
        let start = self.next[index].take().unwrap_or(fault.at).max(after);
        // The last byte is complete before the fault ends.
        let within = fault
            .until()
            .checked_since(start)
            .map_or(0, SimDuration::as_nanos);
        let capacity = within.saturating_sub(1) / byte_time.as_nanos();
        let (count, pause) = match fault.kind {
            FaultKind::Babble { pause } => {
                let count = self.stream.between(1, BLOCK);
                let pause = self.stream.between(0, 2 * pause.as_nanos());
                (count, SimDuration::from_nanos(pause))
            }
            _ => (BLOCK, SimDuration::ZERO),
        };
        let generated = count.min(capacity);
        for n in 1..=generated {
            let byte = match fault.kind {
                FaultKind::Stuck => 0,
                _ => self.stream.bits().to_le_bytes()[0],
            };
            out.push_byte(start + byte_time * n, byte_time, Octet::good(byte));
        }
        let end = start + byte_time * generated;
        self.until = self.until.max(end);
        if generated == count {
            self.next[index] = Some(end + pause);
        }
        (index, generated)
    }
}
