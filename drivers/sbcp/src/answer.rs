use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{ErrorCode, HEADER, PACKET_MAX};
use crate::intake::split_off;
use crate::packet::{Address, Packet, packet_len};

/// An answer as the bus controller hears it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Answer {
    from: Address,
    bytes: [u8; PACKET_MAX],
    got: usize,
    /// Length of the packet; 0 until its length byte is in.
    need: usize,
    /// When its header was complete.
    first: SimTime,
    /// When its last byte so far was.
    pub(crate) last: SimTime,
}

/// So many bytes of a packet tell its length.
const HEAD: usize = 4;

/// How far an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hearing {
    GoesOn,
    /// It is complete, and its checksum right.
    Good,
    /// It is complete, and its checksum wrong.
    Damaged,
    /// It is none of that board.
    Strange,
}

impl Answer {
    /// The answer of `from` begins at `first`.
    pub(crate) fn new(from: Address, first: SimTime) -> Self {
        Self {
            from,
            bytes: [0; PACKET_MAX],
            got: 0,
            need: 0,
            first,
            last: first,
        }
    }

    pub(crate) fn from(&self) -> Address {
        self.from
    }

    pub(crate) fn first(&self) -> SimTime {
        self.first
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.got]
    }

    /// When it is given up, and why: its first four bytes must be there within the time-out, and the last
    /// one as much after the end that the length byte promises; all of it within the limit.
    pub(crate) fn deadline(
        &self,
        timeout: SimDuration,
        limit: SimDuration,
        byte_time: SimDuration,
    ) -> (SimTime, ErrorCode) {
        let end = match self.need {
            0 => self.first + timeout,
            need => self.last + byte_time * (need - self.got) as u64 + timeout,
        };
        if end <= self.first + limit {
            (end, ErrorCode::TRUNCATED)
        } else {
            (self.first + limit, ErrorCode::BABBLE)
        }
    }

    /// When it is known how long it is, or it is over, if it goes on without a break.
    pub(crate) fn expects(&self, byte_time: SimDuration) -> SimTime {
        let wanted = if self.need == 0 { HEAD } else { self.need };
        self.last + byte_time * (wanted - self.got) as u64
    }

    /// Hears the beginning of `rest`: gives what it took for a part of the answer.
    pub(crate) fn receive<'a>(&mut self, rest: &mut Piece<'a>) -> (Piece<'a>, Hearing) {
        let head = [HEADER, self.from.class(), self.from.id()];
        let wanted = match self.got {
            // Those that are right, or the first that is wrong: what is passed on does not depend on the pieces.
            got @ 0..3 => {
                let pairs = rest.bytes.iter().zip(&head[got..]);
                pairs
                    .take_while(|(byte, right)| byte == right)
                    .count()
                    .max(1)
            }
            3 => 1,
            got => self.need - got,
        };
        let part = split_off(rest, wanted);
        let end = self.got + part.bytes.len();
        self.bytes[self.got..end].copy_from_slice(part.bytes);
        let begin = std::mem::replace(&mut self.got, end);
        self.last = part.last();
        let hearing = match begin {
            0..3 if head[begin..end] != *part.bytes => Hearing::Strange,
            3 if end == 4 => {
                self.need = packet_len(self.bytes[3]).unwrap_or_default();
                if self.need == 0 {
                    Hearing::Strange
                } else {
                    Hearing::GoesOn
                }
            }
            4.. if end == self.need => match Packet::new(self.bytes()) {
                Ok(_) => Hearing::Good,
                Err(_) => Hearing::Damaged,
            },
            _ => Hearing::GoesOn,
        };
        (part, hearing)
    }
}
