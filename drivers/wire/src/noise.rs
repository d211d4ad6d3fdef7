use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime, Stream};

use crate::arrivals::Octet;
use crate::{Arrivals, Fault, FaultKind};

/// Bytes that nobody sent: of a line held low, or of one who babbles. Made in blocks, each when it begins.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Noise {
    stream: Stream,
    /// For each fault, when its next block begins; none if it makes no noise, or not any more.
    next: Vec<Option<SimTime>>,
    /// When the last block is over.
    pub(crate) until: SimTime,
}

/// Bytes in a block, at most.
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

    /// When the next block begins.
    pub(crate) fn next_block(&self) -> Option<SimTime> {
        self.next.iter().flatten().min().copied()
    }

    /// Appends the next block, which begins after what is there already; says how many bytes it has.
    pub(crate) fn block(
        &mut self,
        faults: &[Fault],
        byte_time: SimDuration,
        after: SimTime,
        out: &mut Arrivals,
    ) -> u64 {
        let earliest = (0..self.next.len()).filter(|n| self.next[*n].is_some());
        let Some(index) = earliest.min_by_key(|n| self.next[*n]) else {
            return 0;
        };
        let fault = &faults[index];
        let start = self.next[index].take().unwrap_or(fault.at).max(after);
        // The last one is complete before the fault is over.
        let within = fault
            .until()
            .checked_since(start)
            .map_or(0, SimDuration::as_nanos);
        let room = within.saturating_sub(1) / byte_time.as_nanos();
        let (count, pause) = match fault.kind {
            FaultKind::Babble { pause } => {
                let count = self.stream.between(1, BLOCK);
                let pause = self.stream.between(0, 2 * pause.as_nanos());
                (count, SimDuration::from_nanos(pause))
            }
            _ => (BLOCK, SimDuration::ZERO),
        };
        let made = count.min(room);
        for n in 1..=made {
            let byte = match fault.kind {
                FaultKind::Stuck => 0,
                _ => self.stream.bits().to_le_bytes()[0],
            };
            out.push_byte(start + byte_time * n, byte_time, Octet::good(byte));
        }
        let end = start + byte_time * made;
        self.until = self.until.max(end);
        if made == count {
            self.next[index] = Some(end + pause);
        }
        made
    }
}
