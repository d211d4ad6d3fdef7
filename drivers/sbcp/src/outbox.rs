use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::{Arrivals, Piece};

/// The sending side of a UART: bytes that are, or will be, on their way, with the instants at which they are
/// complete.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Outbox {
    byte_time: SimDuration,
    /// Bytes from `done` on are those of `runs`, end to end.
    bytes: Vec<u8>,
    done: usize,
    runs: VecDeque<Run>,
    /// When the last byte is complete.
    end: SimTime,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Run {
    first: SimTime,
    count: usize,
}

impl Outbox {
    pub(crate) fn new(byte_time: SimDuration) -> Self {
        Self {
            byte_time,
            bytes: Vec::with_capacity(256),
            done: 0,
            runs: VecDeque::with_capacity(16),
            end: SimTime::ZERO,
        }
    }

    /// When it has sent everything.
    pub(crate) fn end(&self) -> SimTime {
        self.end
    }

    /// Sends bytes one after another, from `start` on or when it has sent what is before them.
    pub(crate) fn send(&mut self, start: SimTime, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.bytes.extend_from_slice(bytes);
        let first = start.max(self.end) + self.byte_time;
        let count = bytes.len();
        match self.runs.back_mut() {
            Some(run) if first == self.end + self.byte_time => run.count += count,
            _ => self.runs.push_back(Run { first, count }),
        }
        self.end = first + self.byte_time * (count as u64 - 1);
    }

    /// Passes on what comes in, not before `start` and so that it never runs dry within the piece.
    pub(crate) fn relay(&mut self, start: SimTime, piece: Piece<'_>) {
        self.send(
            start.max(unbroken_start(piece, self.byte_time)),
            piece.bytes,
        );
    }

    /// When the first bit of what it sends next goes out, or went.
    pub(crate) fn next_start(&self) -> Option<SimTime> {
        let first = self.runs.front()?.first.as_nanos();
        Some(SimTime::from_nanos(first - self.byte_time.as_nanos()))
    }

    /// Hands over the next bytes that go out without a break, if their first bit does by `now`.
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

    /// Hands over everything, complete or not.
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

/// The earliest start of bytes that follow one another every `byte_time` and are never sent before they
/// have come.
pub(crate) fn unbroken_start(piece: Piece<'_>, byte_time: SimDuration) -> SimTime {
    if piece.spacing <= byte_time {
        return piece.first;
    }
    let before_last = byte_time * (piece.bytes.len() as u64).saturating_sub(1);
    let start = piece.last().as_nanos() - before_last.as_nanos();
    SimTime::from_nanos(start)
}
