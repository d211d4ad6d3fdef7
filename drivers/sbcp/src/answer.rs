use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{ErrorCode, HEADER, PACKET_MAX};
use crate::link_receiver::split_off;
use crate::packet::{Address, Packet, packet_len, recipient};

/// Answer of a board as the bus controller receives it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Answer {
    from: Address,
    bytes: [u8; PACKET_MAX],
    received: usize,
    /// Length of the packet; 0 until its length byte is received.
    length: usize,
    /// Completion time of the header byte.
    first: SimTime,
    /// Completion time of the last byte so far.
    pub(crate) last: SimTime,
}

/// Number of bytes that determine the length of a packet.
pub(crate) const PREFIX_LEN: usize = 4;

/// Progress of the reception of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum AnswerProgress {
    Incomplete,
    /// Complete with a valid checksum.
    Valid,
    /// Complete with a wrong checksum.
    Damaged,
    /// Not an answer of that board.
    Unexpected,
}

impl Answer {
    /// Starts the reception of an answer of `from`, whose header byte is complete at `first`.
    pub(crate) fn new(from: Address, first: SimTime) -> Self {
        Self {
            from,
            bytes: [0; PACKET_MAX],
            received: 0,
            length: 0,
            first,
            last: first,
        }
    }

    /// Receives a whole answer of `from` at once: valid or damaged; none if the bytes are not
    /// exactly one.
    pub(crate) fn receive_whole(from: Address, bytes: &[u8]) -> Option<AnswerProgress> {
        if recipient(bytes) != Some(from.word()) {
            return None;
        }
        Some(match Packet::new(bytes) {
            Ok(_) => AnswerProgress::Valid,
            Err(_) => AnswerProgress::Damaged,
        })
    }

    pub(crate) fn from(&self) -> Address {
        self.from
    }

    pub(crate) fn first(&self) -> SimTime {
        self.first
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.received]
    }

    /// Returns the deadline and the error reported after it: the first four bytes within the
    /// time-out, the last byte at most the time-out later than the length byte implies, all of it
    /// within the limit.
    pub(crate) fn deadline(
        &self,
        timeout: SimDuration,
        limit: SimDuration,
        byte_time: SimDuration,
    ) -> (SimTime, ErrorCode) {
        let end = match self.length {
            0 => self.first + timeout,
            length => self.last + byte_time * (length - self.received) as u64 + timeout,
        };
        if end <= self.first + limit {
            (end, ErrorCode::TRUNCATED)
        } else {
            (self.first + limit, ErrorCode::BABBLE)
        }
    }

    /// Completion time of the byte that determines the length or completes the answer, if the
    /// answer continues without a pause.
    pub(crate) fn next_decision(&self, byte_time: SimDuration) -> SimTime {
        let required = if self.length == 0 {
            PREFIX_LEN
        } else {
            self.length
        };
        self.last + byte_time * (required - self.received) as u64
    }

    /// Receives the beginning of `rest`; returns the part that belongs to the answer.
    pub(crate) fn receive<'a>(&mut self, rest: &mut Piece<'a>) -> (Piece<'a>, AnswerProgress) {
        let expected = [HEADER, self.from.class(), self.from.id()];
        let required = match self.received {
            // Matching bytes, or the first wrong one, so that the relayed bytes do not depend on
            // the pieces.
            received @ 0..3 => {
                let pairs = rest.bytes.iter().zip(&expected[received..]);
                pairs
                    .take_while(|(byte, right)| byte == right)
                    .count()
                    .max(1)
            }
            3 => 1,
            received => self.length - received,
        };
        let part = split_off(rest, required);
        let end = self.received + part.bytes.len();
        self.bytes[self.received..end].copy_from_slice(part.bytes);
        let begin = std::mem::replace(&mut self.received, end);
        self.last = part.last();
        let progress = match begin {
            0..3 if expected[begin..end] != *part.bytes => AnswerProgress::Unexpected,
            3 if end == 4 => {
                self.length = packet_len(self.bytes[3]).unwrap_or_default();
                if self.length == 0 {
                    AnswerProgress::Unexpected
                } else {
                    AnswerProgress::Incomplete
                }
            }
            4.. if end == self.length => match Packet::new(self.bytes()) {
                Ok(_) => AnswerProgress::Valid,
                Err(_) => AnswerProgress::Damaged,
            },
            _ => AnswerProgress::Incomplete,
        };
        (part, progress)
    }
}
