use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{ErrorCode, HEADER, PACKET_MAX};
use crate::packet::{Address, Packet, packet_len};
use crate::uart_transmitter::unbroken_start;

/// Request being received from the host.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Entry {
    bytes: [u8; PACKET_MAX],
    received: usize,
    /// Length of the packet; 0 until its length byte is received.
    len: usize,
    /// Whether it is complete and its checksum is right.
    valid: bool,
    /// Time at which its address and length are known.
    pub(crate) addressed: SimTime,
    /// Completion time of its last byte so far.
    pub(crate) last: SimTime,
    /// Earliest start at which the bytes so far can be transmitted without a pause.
    pub(crate) unbroken: SimTime,
    /// Error because of which it is not put on the bus.
    pub(crate) error: Option<ErrorCode>,
}

impl Entry {
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.received]
    }

    pub(crate) fn is_complete(&self) -> bool {
        self.len > 0 && self.received == self.len
    }

    /// Returns the destination, once the length is known.
    pub(crate) fn to(&self) -> Option<Address> {
        if self.len == 0 {
            return None;
        }
        Address::new(self.bytes[1], self.bytes[2]).ok()
    }

    /// Whether it is a valid packet.
    pub(crate) fn is_valid(&self) -> bool {
        self.valid
    }

    /// Returns the packet, if it is valid.
    pub(crate) fn packet(&self) -> Option<Packet<'_>> {
        Packet::new(self.bytes()).ok()
    }

    fn add(&mut self, part: Piece<'_>, byte_time: SimDuration) {
        let end = self.received + part.bytes.len();
        self.bytes[self.received..end].copy_from_slice(part.bytes);
        let before = byte_time * self.received as u64;
        let start = unbroken_start(part, byte_time).as_nanos();
        let start = SimTime::from_nanos(start.saturating_sub(before.as_nanos()));
        self.unbroken = self.unbroken.max(start);
        self.last = part.last();
        self.received = end;
        self.valid = self.is_complete() && self.packet().is_some();
    }

    /// Evaluates the first four bytes: sets the length, or drops bytes up to the next header and
    /// returns their number.
    fn parse_header(&mut self, byte_time: SimDuration) -> usize {
        let [_, class, id, length, ..] = self.bytes;
        if let (Ok(_), Some(len)) = (Address::new(class, id), packet_len(length)) {
            self.len = len;
            self.addressed = self.last;
            return 0;
        }
        let next = self.bytes[1..4].iter().position(|byte| *byte == HEADER);
        let garbage = next.map_or(4, |at| at + 1);
        self.bytes.copy_within(garbage..4, 0);
        self.received -= garbage;
        // The remaining bytes were received last, approximately at the pace of the link.
        let before = byte_time * self.received as u64;
        let start = self.last.as_nanos().saturating_sub(before.as_nanos());
        self.unbroken = SimTime::from_nanos(start);
        garbage
    }
}

/// Link side of the bus controller: queued requests, and the one being received.
///
/// Pieces may be announced before their bytes are complete, so requests may be complete in the
/// future; each holds its times.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct LinkReceiver {
    idle: SimDuration,
    byte_time: SimDuration,
    packets_max: usize,
    /// Request being received.
    pub(crate) current: Entry,
    /// Complete or refused requests, in order.
    queue: VecDeque<Entry>,
    /// Number of queued requests already admitted to the buffer or refused.
    checked: usize,
    /// Time at which the last request taken in advance is on the bus.
    popped_until: SimTime,
    pub(crate) garbage: u64,
    overflows: u64,
}

impl LinkReceiver {
    pub(crate) fn new(idle_gap: SimDuration, byte_time: SimDuration, packets_max: usize) -> Self {
        Self {
            idle: idle_gap + byte_time,
            byte_time,
            packets_max,
            current: Entry::default(),
            queue: VecDeque::with_capacity(2 * packets_max),
            checked: 0,
            popped_until: SimTime::ZERO,
            garbage: 0,
            overflows: 0,
        }
    }

    /// Time at which the request being received is interrupted unless more bytes arrive.
    pub(crate) fn interruption(&self) -> Option<SimTime> {
        let incomplete = self.current.received > 0 && !self.current.is_complete();
        incomplete.then(|| self.current.last + self.idle)
    }

    /// Takes the beginning of `rest`, up to the next decision about the request; returns the part
    /// taken.
    pub(crate) fn take<'a>(&mut self, rest: &mut Piece<'a>) -> Piece<'a> {
        if self.current.received == 0 {
            let header = rest.bytes.iter().position(|byte| *byte == HEADER);
            let garbage = header.unwrap_or(rest.bytes.len());
            self.garbage += garbage as u64;
            split_off(rest, garbage);
        }
        let required = match self.current.len {
            0 => 4,
            len => len,
        };
        let part = split_off(rest, required - self.current.received);
        if !part.bytes.is_empty() {
            self.current.add(part, self.byte_time);
            if self.current.len == 0 && self.current.received == 4 {
                self.garbage += self.current.parse_header(self.byte_time) as u64;
            }
        }
        part
    }

    /// Takes the request being received, complete or not; the next one may follow.
    pub(crate) fn take_current(&mut self) -> Entry {
        std::mem::take(&mut self.current)
    }

    /// Queues the request being received.
    pub(crate) fn queue_current(&mut self, error: Option<ErrorCode>) {
        self.queue.push_back(Entry {
            error,
            ..std::mem::take(&mut self.current)
        });
    }

    /// Admits requests complete by `now` to the buffer or refuses them, in order. `busy`: one is on
    /// the bus and occupies its place until it is completed.
    pub(crate) fn admit(&mut self, now: SimTime, busy: bool) {
        let mut kept = self.kept();
        while let Some(entry) = self.queue.get(self.checked).filter(|of| of.last <= now) {
            if entry.error.is_none() {
                if self.has_place(kept, busy, entry) {
                    kept += 1;
                } else {
                    self.queue[self.checked].error = Some(ErrorCode::OVERFLOW);
                    self.overflows += 1;
                }
            }
            self.checked += 1;
        }
    }

    /// Returns the number of requests refused for lack of space by `now`, as
    /// [`LinkReceiver::admit`] would.
    pub(crate) fn overflows(&self, now: SimTime, busy: bool) -> u64 {
        let (mut kept, mut overflows) = (self.kept(), self.overflows);
        let complete = self.queue.iter().skip(self.checked);
        for entry in complete.take_while(|entry| entry.last <= now) {
            if entry.error.is_none() {
                let has_place = self.has_place(kept, busy, entry);
                kept += usize::from(has_place);
                overflows += u64::from(!has_place);
            }
        }
        overflows
    }

    /// Returns the number of requests in the buffer.
    fn kept(&self) -> usize {
        let checked = self.queue.iter().take(self.checked);
        checked.filter(|entry| entry.error.is_none()).count()
    }

    /// Whether the buffer with `kept` requests has a place for another one. That of a request taken
    /// in advance is free only after the time at which it is on the bus.
    fn has_place(&self, kept: usize, busy: bool, entry: &Entry) -> bool {
        let in_advance = entry.last <= self.popped_until;
        kept + usize::from(busy) + usize::from(in_advance) < self.packets_max
    }

    /// Returns the request that will be the next one at `at`, if it is complete by then whatever
    /// is received meanwhile, and no other is refused.
    pub(crate) fn next_at(&self, at: SimTime) -> Option<&Entry> {
        let certain = self.current.received == 0 && self.overflows(at, true) == self.overflows;
        self.front().filter(|entry| certain && entry.last <= at)
    }

    /// Removes the first request at `at`, which may be in the future.
    pub(crate) fn pop_at(&mut self, at: SimTime) {
        self.admit(at, true);
        self.popped_until = at;
        self.pop();
    }

    pub(crate) fn front(&self) -> Option<&Entry> {
        self.queue.front()
    }

    pub(crate) fn pop(&mut self) {
        self.queue.pop_front();
        self.checked = self.checked.saturating_sub(1);
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
