use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_wire::Piece;

use crate::codes::{HEADER, OVERHEAD, PACKET_MAX};
use crate::packet::{Address, Packet, Request, packet_len};

/// Parser of a slave: extracts the requests for one device from all bytes on the bus.
///
/// It trusts length bytes and skips packets for other devices without checking them, as a board
/// with limited time does. Unlike [`crate::Parser`] it does not search skipped bytes for missed
/// packets: a late answer could collide with another transmission. So after garbage it may miss
/// packets that begin within the next [`PACKET_MAX`] bytes; silence longer than the idle gap
/// resynchronises it at once.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct RequestParser {
    idle_gap: SimDuration,
    byte_time: SimDuration,
    /// First bytes of a packet that is, or may be, for this device.
    buffer: [u8; PACKET_MAX],
    len: usize,
    /// Number of bytes to skip.
    skip: usize,
    /// Completion time of the last byte.
    last: SimTime,
    pub(crate) damaged: u64,
    pub(crate) garbage: u64,
}

/// Result of the first four bytes of a packet.
enum Beginning {
    ForThis(usize),
    ForOther(usize),
    Garbage,
}

fn beginning(bytes: [u8; 4], address: Address) -> Beginning {
    let [_, class, id, length] = bytes;
    match (Address::new(class, id), packet_len(length)) {
        (Ok(to), Some(len)) if to.is_for(address) => Beginning::ForThis(len),
        (Ok(_), Some(len)) => Beginning::ForOther(len),
        _ => Beginning::Garbage,
    }
}

impl RequestParser {
    pub(crate) fn new(idle_gap: SimDuration, byte_time: SimDuration) -> Self {
        Self {
            idle_gap,
            byte_time,
            buffer: [0; PACKET_MAX],
            len: 0,
            skip: 0,
            last: SimTime::ZERO,
            damaged: 0,
            garbage: 0,
        }
    }

    /// Discards the bytes received so far.
    pub(crate) fn reset(&mut self) {
        self.len = 0;
        self.skip = 0;
    }

    /// Returns the minimum number of bytes missing for the next request.
    pub(crate) fn missing(&self) -> usize {
        let length = self.buffer[3];
        match self.len {
            0 => self.skip + OVERHEAD,
            1..4 => OVERHEAD - self.len,
            len => packet_len(length).map_or(1, |whole| whole.saturating_sub(len).max(1)),
        }
    }

    /// Whether a packet to another device whose bytes are complete at `spacing` changes nothing but
    /// the time of the last byte, on which the result depends only within a packet.
    pub(crate) fn ignores_others(&self, spacing: SimDuration) -> bool {
        self.len == 0 && self.skip == 0 && spacing <= self.idle_gap + self.byte_time
    }

    /// Registers dropped bytes: the line is busy during them, but may have been idle before.
    pub(crate) fn line_busy(&mut self, piece: Piece<'_>) {
        if self.was_idle(piece) {
            self.reset();
        }
    }

    /// Begins a piece; returns the number of bytes already processed, to be passed to
    /// [`RequestParser::next`].
    pub(crate) fn begin(&mut self, piece: Piece<'_>) -> usize {
        let was_idle = self.was_idle(piece);
        if piece.spacing > self.idle_gap + self.byte_time && piece.bytes.len() > 1 {
            // Single bytes, each with an idle gap before it: none of them completes a packet.
            self.reset();
            self.garbage += piece.bytes.len() as u64;
            return piece.bytes.len();
        }
        if was_idle {
            self.reset();
        }
        0
    }

    /// Whether the line was idle before the piece for longer than the idle gap. Registers the
    /// piece.
    fn was_idle(&mut self, piece: Piece<'_>) -> bool {
        let idle = piece.first.checked_since(self.last);
        self.last = self.last.max(piece.last());
        idle.is_some_and(|idle| idle > self.idle_gap + self.byte_time)
    }

    /// Returns the next request to `address` in the piece, from byte `at` on, with the time of its
    /// last bit. None if the piece is processed.
    pub(crate) fn next(
        &mut self,
        address: Address,
        piece: Piece<'_>,
        at: &mut usize,
    ) -> Option<(SimTime, Request)> {
        while let Some(rest) = piece.bytes.get(*at..).filter(|rest| !rest.is_empty()) {
            if self.skip > 0 {
                let skipped = self.skip.min(rest.len());
                self.skip -= skipped;
                *at += skipped;
                continue;
            }
            let request = match (self.len, rest) {
                (0, &[HEADER, b, c, d, ..]) => {
                    self.parse_header([HEADER, b, c, d], address, rest, at)
                }
                (0, &[first, ..]) if first != HEADER => {
                    let next = rest.iter().position(|byte| *byte == HEADER);
                    let garbage = next.unwrap_or(rest.len());
                    self.garbage += garbage as u64;
                    *at += garbage;
                    None
                }
                _ => {
                    self.buffer[self.len] = rest[0];
                    self.len += 1;
                    *at += 1;
                    self.parse_buffer(address)
                }
            };
            if let Some(request) = request {
                return Some((piece.at(*at - 1), request));
            }
        }
        None
    }

    /// Evaluates the header of a packet at the front of `rest`, which has at least four bytes,
    /// while nothing is buffered.
    fn parse_header(
        &mut self,
        four: [u8; 4],
        address: Address,
        rest: &[u8],
        at: &mut usize,
    ) -> Option<Request> {
        match beginning(four, address) {
            Beginning::ForThis(len) => {
                if let Some(packet) = rest.get(..len) {
                    *at += len;
                    return self.parse_packet(packet);
                }
                self.buffer[..rest.len()].copy_from_slice(rest);
                self.len = rest.len();
                *at += rest.len();
            }
            Beginning::ForOther(len) => {
                self.skip = len;
            }
            Beginning::Garbage => {
                self.garbage += 1;
                *at += 1;
            }
        }
        None
    }

    /// Evaluates the buffer after a byte was added.
    fn parse_buffer(&mut self, address: Address) -> Option<Request> {
        if self.len < 4 {
            return None;
        }
        let [a, b, c, d, ..] = self.buffer;
        match beginning([a, b, c, d], address) {
            Beginning::ForThis(len) if self.len == len => {
                self.len = 0;
                let packet = self.buffer;
                return self.parse_packet(&packet[..len]);
            }
            Beginning::ForThis(_) => {}
            Beginning::ForOther(len) => {
                self.skip = len - self.len;
                self.len = 0;
            }
            Beginning::Garbage => {
                let next = [b, c, d].iter().position(|byte| *byte == HEADER);
                let garbage = next.map_or(self.len, |at| at + 1);
                self.garbage += garbage as u64;
                self.buffer.copy_within(garbage..self.len, 0);
                self.len -= garbage;
            }
        }
        None
    }

    fn parse_packet(&mut self, packet: &[u8]) -> Option<Request> {
        let request = Packet::new(packet).and_then(|packet| Request::parse(&packet));
        self.damaged += u64::from(request.is_err());
        request.ok()
    }
}
