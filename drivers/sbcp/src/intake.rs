use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{ErrorCode, HEADER, PACKET_MAX};
use crate::outbox::unbroken_start;
use crate::packet::{Address, Packet, packet_len};

/// A request as it comes in from the host.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Entry {
    bytes: [u8; PACKET_MAX],
    have: usize,
    /// Length of the packet; 0 until its length byte is in.
    len: usize,
    /// When it is known whom it is for, and how long it is.
    pub(crate) known: SimTime,
    /// When its last byte so far was complete.
    pub(crate) last: SimTime,
    /// Earliest start at which what is there can be sent without a break.
    pub(crate) unbroken: SimTime,
    /// Why it is not put on the bus.
    pub(crate) refused: Option<ErrorCode>,
}

impl Entry {
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.have]
    }

    pub(crate) fn is_complete(&self) -> bool {
        self.len > 0 && self.have == self.len
    }

    /// Whom it is for, once it is known how long it is.
    pub(crate) fn to(&self) -> Option<Address> {
        if self.len == 0 {
            return None;
        }
        Address::new(self.bytes[1], self.bytes[2]).ok()
    }

    /// The whole packet, if it is one.
    pub(crate) fn packet(&self) -> Option<Packet<'_>> {
        Packet::new(self.bytes()).ok()
    }

    fn add(&mut self, part: Piece<'_>, byte_time: SimDuration) {
        let end = self.have + part.bytes.len();
        self.bytes[self.have..end].copy_from_slice(part.bytes);
        let before = byte_time * self.have as u64;
        let start = unbroken_start(part, byte_time).as_nanos();
        let start = SimTime::from_nanos(start.saturating_sub(before.as_nanos()));
        self.unbroken = self.unbroken.max(start);
        self.last = part.last();
        self.have = end;
    }

    /// Four bytes are there: looks at the length, or finds that this is no packet and says how many bytes
    /// are garbage.
    fn look(&mut self, byte_time: SimDuration) -> usize {
        let [_, class, id, length, ..] = self.bytes;
        if let (Ok(_), Some(len)) = (Address::new(class, id), packet_len(length)) {
            self.len = len;
            self.known = self.last;
            return 0;
        }
        let next = self.bytes[1..4].iter().position(|byte| *byte == HEADER);
        let garbage = next.map_or(4, |at| at + 1);
        self.bytes.copy_within(garbage..4, 0);
        self.have -= garbage;
        // Those that are left have come at the end, at the pace of the link or about.
        let before = byte_time * self.have as u64;
        let start = self.last.as_nanos().saturating_sub(before.as_nanos());
        self.unbroken = SimTime::from_nanos(start);
        garbage
    }
}

/// The side of the bus controller that hears the host: requests that wait, and the one that comes in.
///
/// Pieces may be announced before their bytes are complete, so what stands here may lie ahead; times say so.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Intake {
    idle: SimDuration,
    byte_time: SimDuration,
    packets_max: usize,
    /// Coming in.
    pub(crate) current: Entry,
    /// Complete, or refused, in order.
    queue: VecDeque<Entry>,
    /// How many of them were let into the buffer, or refused, so far.
    judged: usize,
    pub(crate) garbage: u64,
    pub(crate) overflows: u64,
}

impl Intake {
    pub(crate) fn new(idle_gap: SimDuration, byte_time: SimDuration, packets_max: usize) -> Self {
        Self {
            idle: idle_gap + byte_time,
            byte_time,
            packets_max,
            current: Entry::default(),
            queue: VecDeque::with_capacity(2 * packets_max),
            judged: 0,
            garbage: 0,
            overflows: 0,
        }
    }

    /// When what is coming in has broken off, if nothing more comes.
    pub(crate) fn breaks_off(&self) -> Option<SimTime> {
        let amid = self.current.have > 0 && !self.current.is_complete();
        amid.then(|| self.current.last + self.idle)
    }

    /// Takes the beginning of what comes in, up to where something is known of it: gives what it took.
    pub(crate) fn take<'a>(&mut self, rest: &mut Piece<'a>) -> Piece<'a> {
        if self.current.have == 0 {
            let header = rest.bytes.iter().position(|byte| *byte == HEADER);
            let garbage = header.unwrap_or(rest.bytes.len());
            self.garbage += garbage as u64;
            split_off(rest, garbage);
        }
        let wanted = match self.current.len {
            0 => 4,
            len => len,
        };
        let part = split_off(rest, wanted - self.current.have);
        if !part.bytes.is_empty() {
            self.current.add(part, self.byte_time);
            if self.current.len == 0 && self.current.have == 4 {
                self.garbage += self.current.look(self.byte_time) as u64;
            }
        }
        part
    }

    /// The packet that has come in, or what there is of it; the next one may come.
    pub(crate) fn take_current(&mut self) -> Entry {
        std::mem::take(&mut self.current)
    }

    /// Queues what has come in.
    pub(crate) fn queue_current(&mut self, refused: Option<ErrorCode>) {
        self.queue.push_back(Entry {
            refused,
            ..std::mem::take(&mut self.current)
        });
    }

    /// Up to `now`, lets requests into the buffer or refuses them, in order. `busy` says whether one is on
    /// the bus, which needs its place until it is over.
    pub(crate) fn admit(&mut self, now: SimTime, busy: bool) {
        while let Some(entry) = self
            .queue
            .get(self.judged)
            .filter(|entry| entry.last <= now)
        {
            if entry.refused.is_none() {
                let before = self.queue.iter().take(self.judged);
                let before = before.filter(|entry| entry.refused.is_none()).count();
                if before + usize::from(busy) >= self.packets_max {
                    self.queue[self.judged].refused = Some(ErrorCode::OVERFLOW);
                    self.overflows += 1;
                }
            }
            self.judged += 1;
        }
    }

    pub(crate) fn front(&self) -> Option<&Entry> {
        self.queue.front()
    }

    pub(crate) fn pop(&mut self) {
        self.queue.pop_front();
        self.judged = self.judged.saturating_sub(1);
    }
}

/// Splits at most `count` bytes off the front.
pub(crate) fn split_off<'a>(rest: &mut Piece<'a>, count: usize) -> Piece<'a> {
    let count = count.min(rest.bytes.len());
    let (bytes, behind) = rest.bytes.split_at(count);
    let part = Piece { bytes, ..*rest };
    *rest = Piece {
        first: rest.at(count),
        bytes: behind,
        ..*rest
    };
    part
}
