use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{HEADER, OVERHEAD, PACKET_MAX};
use crate::packet::{Address, Packet, Request, packet_len};

/// A slave's ear: of everything on the bus, it picks the requests for one device.
///
/// It believes length bytes and lets what is for others pass without a look, as a board does that has other
/// things to do. Unlike [`crate::Parser`] it does not search what has passed for packets that it may have
/// missed: answering them then would be answering into somebody else's time. So after garbage it may miss
/// what begins within the next [`PACKET_MAX`] bytes; silence longer than the idle gap puts it right at once.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Listener {
    idle_gap: SimDuration,
    byte_time: SimDuration,
    /// The beginning of a packet that is, or may be, for this device.
    held: [u8; PACKET_MAX],
    len: usize,
    /// Bytes that are still to pass unheard.
    skip: usize,
    /// When the last byte was complete.
    last: SimTime,
    pub(crate) damaged: u64,
    pub(crate) garbage: u64,
}

/// What the first four bytes of a packet tell.
enum Beginning {
    ForUs(usize),
    ForOthers(usize),
    Garbage,
}

fn beginning(bytes: [u8; 4], own: Address) -> Beginning {
    let [_, class, id, length] = bytes;
    match (Address::new(class, id), packet_len(length)) {
        (Ok(to), Some(len)) if to.is_for(own) => Beginning::ForUs(len),
        (Ok(_), Some(len)) => Beginning::ForOthers(len),
        _ => Beginning::Garbage,
    }
}

impl Listener {
    pub(crate) fn new(idle_gap: SimDuration, byte_time: SimDuration) -> Self {
        Self {
            idle_gap,
            byte_time,
            held: [0; PACKET_MAX],
            len: 0,
            skip: 0,
            last: SimTime::ZERO,
            damaged: 0,
            garbage: 0,
        }
    }

    /// Forgets what was heard.
    pub(crate) fn reset(&mut self) {
        self.len = 0;
        self.skip = 0;
    }

    /// How many bytes are missing of the next request, at least.
    pub(crate) fn missing(&self) -> usize {
        let length = self.held[3];
        match self.len {
            0 => self.skip + OVERHEAD,
            1..4 => OVERHEAD - self.len,
            len => packet_len(length).map_or(1, |whole| whole.saturating_sub(len).max(1)),
        }
    }

    /// Bytes pass that are dropped: the line is not idle meanwhile, but it may have been before.
    pub(crate) fn line_busy(&mut self, piece: Piece<'_>) {
        if self.was_idle(piece) {
            self.reset();
        }
    }

    /// Begins to hear a piece: says how many of its bytes are done with. [`Listener::next`] takes it from there.
    pub(crate) fn begin(&mut self, piece: Piece<'_>) -> usize {
        let was_idle = self.was_idle(piece);
        if piece.spacing > self.idle_gap + self.byte_time && piece.bytes.len() > 1 {
            // Every byte stands alone; none of them completes a packet.
            self.reset();
            self.garbage += piece.bytes.len() as u64;
            return piece.bytes.len();
        }
        if was_idle {
            self.reset();
        }
        0
    }

    /// Whether the line was idle before that piece, for longer than the idle gap of a packet. The piece has passed then.
    fn was_idle(&mut self, piece: Piece<'_>) -> bool {
        let idle = piece.first.checked_since(self.last);
        self.last = self.last.max(piece.last());
        idle.is_some_and(|idle| idle > self.idle_gap + self.byte_time)
    }

    /// The next request for `own` in the piece, from byte `at` on, with the instant of its last bit. Nothing
    /// if the piece is heard to its end.
    pub(crate) fn next(
        &mut self,
        own: Address,
        piece: Piece<'_>,
        at: &mut usize,
    ) -> Option<(SimTime, Request)> {
        while let Some(rest) = piece.bytes.get(*at..).filter(|rest| !rest.is_empty()) {
            if self.skip > 0 {
                let passed = self.skip.min(rest.len());
                self.skip -= passed;
                *at += passed;
                continue;
            }
            let request = match (self.len, rest) {
                (0, &[HEADER, b, c, d, ..]) => self.hear_four([HEADER, b, c, d], own, rest, at),
                (0, &[first, ..]) if first != HEADER => {
                    let next = rest.iter().position(|byte| *byte == HEADER);
                    let garbage = next.unwrap_or(rest.len());
                    self.garbage += garbage as u64;
                    *at += garbage;
                    None
                }
                _ => {
                    self.held[self.len] = rest[0];
                    self.len += 1;
                    *at += 1;
                    self.hear_one(own)
                }
            };
            if let Some(request) = request {
                return Some((piece.at(*at - 1), request));
            }
        }
        None
    }

    /// A packet begins with `rest`, of which four bytes are there, and none is held.
    fn hear_four(
        &mut self,
        four: [u8; 4],
        own: Address,
        rest: &[u8],
        at: &mut usize,
    ) -> Option<Request> {
        match beginning(four, own) {
            Beginning::ForUs(len) => {
                if let Some(packet) = rest.get(..len) {
                    *at += len;
                    return self.judge(packet);
                }
                self.held[..rest.len()].copy_from_slice(rest);
                self.len = rest.len();
                *at += rest.len();
            }
            Beginning::ForOthers(len) => {
                self.skip = len;
            }
            Beginning::Garbage => {
                self.garbage += 1;
                *at += 1;
            }
        }
        None
    }

    /// A byte was added to those held.
    fn hear_one(&mut self, own: Address) -> Option<Request> {
        if self.len < 4 {
            return None;
        }
        let [a, b, c, d, ..] = self.held;
        match beginning([a, b, c, d], own) {
            Beginning::ForUs(len) if self.len == len => {
                self.len = 0;
                let packet = self.held;
                return self.judge(&packet[..len]);
            }
            Beginning::ForUs(_) => {}
            Beginning::ForOthers(len) => {
                self.skip = len - self.len;
                self.len = 0;
            }
            Beginning::Garbage => {
                let next = [b, c, d].iter().position(|byte| *byte == HEADER);
                let garbage = next.map_or(self.len, |at| at + 1);
                self.garbage += garbage as u64;
                self.held.copy_within(garbage..self.len, 0);
                self.len -= garbage;
            }
        }
        None
    }

    fn judge(&mut self, packet: &[u8]) -> Option<Request> {
        let request = Packet::new(packet).and_then(|packet| Request::parse(&packet));
        self.damaged += u64::from(request.is_err());
        request.ok()
    }
}
