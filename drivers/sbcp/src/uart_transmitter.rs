use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::{Arrivals, Piece};

/// Transmitter of a UART: bytes that are or will be transmitted, with their completion times.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct UartTransmitter {
    byte_time: SimDuration,
    /// Bytes from `done` on are those of `runs`, end to end.
    bytes: Vec<u8>,
    done: usize,
    runs: VecDeque<Run>,
    /// Completion time of the last byte.
    end: SimTime,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Run {
    first: SimTime,
    count: usize,
}

impl UartTransmitter {
    pub(crate) fn new(byte_time: SimDuration) -> Self {
        Self {
            byte_time,
            bytes: Vec::with_capacity(256),
            done: 0,
            runs: VecDeque::with_capacity(16),
            end: SimTime::ZERO,
        }
    }

    /// Time at which all bytes are transmitted.
    pub(crate) fn end(&self) -> SimTime {
        self.end
    }

    /// Transmits contiguous bytes from `start` on, or after the previous ones.
    pub(crate) fn send(&mut self, start: SimTime, bytes: &[u8]) {
        self.transmit(start, bytes, true);
    }

    /// The same for the beginning of a packet, which is not passed on in one piece with the bytes
    /// before it.
    pub(crate) fn send_packet(&mut self, start: SimTime, bytes: &[u8]) {
        self.transmit(start, bytes, false);
    }

    fn transmit(&mut self, start: SimTime, bytes: &[u8], may_continue: bool) {
        if bytes.is_empty() {
            return;
        }
        self.bytes.extend_from_slice(bytes);
        let first = start.max(self.end) + self.byte_time;
        let count = bytes.len();
        match self.runs.back_mut() {
            Some(run) if may_continue && first == self.end + self.byte_time => run.count += count,
            _ => self.runs.push_back(Run { first, count }),
        }
        self.end = first + self.byte_time * (count as u64 - 1);
    }

    /// Relays received bytes, not before `start` and late enough that there is no pause within the
    /// piece.
    pub(crate) fn relay(&mut self, start: SimTime, piece: Piece<'_>) {
        self.send(
            start.max(unbroken_start(piece, self.byte_time)),
            piece.bytes,
        );
    }

    /// Start of the first bit of the next bytes, which may be in the past.
    pub(crate) fn next_start(&self) -> Option<SimTime> {
        let first = self.runs.front()?.first.as_nanos();
        Some(SimTime::from_nanos(first - self.byte_time.as_nanos()))
    }

    /// Passes the next contiguous bytes to `send` if their first bit is out by `now`.
    pub(crate) fn take_started(&mut self, now: SimTime, send: &mut dyn FnMut(Piece<'_>)) -> bool {
        if self.next_start().is_none_or(|start| start > now) {
            return false;
        }
        let Some(run) = self.runs.pop_front() else {
            return false;
        };
        send(Piece {
            first: run.first,
            spacing: self.byte_time,
            bytes: &self.bytes[self.done..self.done + run.count],
            framing_error: false,
        });
        self.drop_front(run.count);
        true
    }

    /// Takes all bytes, complete or not.
    pub(crate) fn take_all(&mut self, arrivals: &mut Arrivals) {
        while let Some(run) = self.runs.pop_front() {
            let bytes = &self.bytes[self.done..self.done + run.count];
            arrivals.push(run.first, self.byte_time, bytes);
            self.drop_front(run.count);
        }
    }

    fn drop_front(&mut self, count: usize) {
        self.done += count;
        if self.done == self.bytes.len() {
            self.bytes.clear();
            self.done = 0;
        }
    }
}

/// Returns the earliest start at which the piece can be transmitted every `byte_time` without a
/// pause and with no byte before its reception.
pub(crate) fn unbroken_start(piece: Piece<'_>, byte_time: SimDuration) -> SimTime {
    if piece.spacing <= byte_time {
        return piece.first;
    }
    let before_last = byte_time * (piece.bytes.len() as u64).saturating_sub(1);
    let start = piece.last().as_nanos() - before_last.as_nanos();
    SimTime::from_nanos(start)
}
