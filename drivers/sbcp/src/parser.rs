use serde::{Deserialize, Serialize};
use twinrig_wire::{FrameMatch, FrameReader};

use crate::codes::{HEADER, Instruction, PACKET_MAX};
use crate::packet::{Packet, packet_len};

/// Finds packets in a byte stream received in pieces of any length, possibly with garbage between
/// the packets.
///
/// If a header byte does not begin a packet, the search continues one byte behind it: no packet is
/// lost to garbage before it, unless the garbage happens to have a valid checksum. It may be found
/// *late*: a header in the garbage is treated as the beginning of a packet for up to [`PACKET_MAX`]
/// bytes. So a packet is found at the latest when `PACKET_MAX - 1` bytes have been received behind
/// the last byte of garbage, or by [`Parser::give_up`], when no more bytes are expected.
///
/// ```
/// use twinrig_sbcp::Parser;
///
/// let mut parser = Parser::default();
/// let mut rest: &[u8] = &[0x17, 0xFF, 0x01, 0x03, 0x02, 0x01, 0x07, 0xFF];
/// let packet = parser.next(&mut rest).unwrap();
/// assert_eq!((packet.class(), packet.id(), packet.code()), (1, 3, 1));
/// assert!(parser.next(&mut rest).is_none() && rest.is_empty());
/// ```
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Parser {
    /// Bytes, beginning with a header, that may become a packet.
    buffer: [u8; PACKET_MAX],
    len: usize,
    /// Number of them that the last call returned as a packet.
    taken: usize,
    skipped: u64,
    /// Class and id of the last packet whose checksum was wrong.
    damaged: Option<(u8, u8)>,
}

/// Packets, for faults of chosen ones. A response with an error is taken for the request whose
/// instruction has the same code.
pub const FRAMES: FrameReader = FrameReader {
    match_frame: |front| match beginning(front) {
        Beginning::Packet(len) => FrameMatch::Frame(len),
        Beginning::Needs(len) => FrameMatch::Missing(len - front.len()),
        Beginning::Garbage | Beginning::Damaged(..) => FrameMatch::Garbage,
    },
    code: |frame| frame.get(4).copied(),
    kinds: &[
        ("ping", Instruction::PING.0),
        ("get", Instruction::GET.0),
        ("set", Instruction::SET.0),
        ("save", Instruction::SAVE.0),
        ("low-latency", Instruction::LOW_LATENCY.0),
    ],
};

/// Result of the first bytes of a stream.
enum Beginning {
    Packet(usize),
    Garbage,
    /// A packet with a wrong checksum, of that class and id.
    Damaged(u8, u8),
    /// Undecided; this many bytes are required for a decision.
    Needs(usize),
}

fn beginning(bytes: &[u8]) -> Beginning {
    match *bytes {
        [] | [HEADER] | [HEADER, _] | [HEADER, _, _] => Beginning::Needs(4),
        [HEADER, class, id, length, ..] => match packet_len(length) {
            Some(len) if class != HEADER && id != HEADER => match bytes.get(..len) {
                Some(bytes) if Packet::new(bytes).is_ok() => Beginning::Packet(len),
                Some(_) => Beginning::Damaged(class, id),
                None => Beginning::Needs(len),
            },
            _ => Beginning::Garbage,
        },
        _ => Beginning::Garbage,
    }
}

impl Parser {
    /// Returns the next complete packet and removes the parsed bytes from `rest`. To be called
    /// until it returns None; then all bytes are taken.
    pub fn next<'p, 'b: 'p>(&'p mut self, rest: &mut &'b [u8]) -> Option<Packet<'p>> {
        self.drop_front(self.taken);
        self.taken = 0;
        while self.len > 0 {
            match beginning(&self.buffer[..self.len.min(PACKET_MAX)]) {
                Beginning::Packet(len) => {
                    self.taken = len;
                    return Packet::new(&self.buffer[..len]).ok();
                }
                Beginning::Garbage => self.resynchronise(),
                Beginning::Damaged(class, id) => {
                    self.damaged = Some((class, id));
                    self.resynchronise();
                }
                Beginning::Needs(_) if rest.is_empty() => return None,
                Beginning::Needs(len) => self.take(len, rest),
            }
        }
        while let Some(start) = rest.iter().position(|byte| *byte == HEADER) {
            self.skipped += start as u64;
            *rest = &rest[start..];
            match beginning(rest) {
                Beginning::Packet(len) => {
                    let (packet, behind) = rest.split_at(len);
                    *rest = behind;
                    return Packet::new(packet).ok();
                }
                Beginning::Garbage => self.skip_one(rest),
                Beginning::Damaged(class, id) => {
                    self.damaged = Some((class, id));
                    self.skip_one(rest);
                }
                Beginning::Needs(len) => {
                    self.take(len, rest);
                    return None;
                }
            }
        }
        self.skipped += rest.len() as u64;
        *rest = &[];
        None
    }

    /// Ends the stream: returns packets hidden behind a false header. To be called until it returns
    /// None; then the parser is empty.
    pub fn give_up(&mut self) -> Option<Packet<'_>> {
        self.drop_front(self.taken);
        self.taken = 0;
        while self.len > 0 {
            if let Beginning::Packet(len) = beginning(&self.buffer[..self.len]) {
                self.taken = len;
                return Packet::new(&self.buffer[..len]).ok();
            }
            self.resynchronise();
        }
        None
    }

    /// Discards the bytes received so far.
    pub fn reset(&mut self) {
        self.skipped += (self.len - self.taken) as u64;
        self.len = 0;
        self.taken = 0;
        self.damaged = None;
    }

    /// Returns class and id of the last packet with a wrong checksum since [`Parser::reset`].
    pub fn damaged(&self) -> Option<(u8, u8)> {
        self.damaged
    }

    /// Whether it holds a possible beginning of a packet.
    pub fn is_partial(&self) -> bool {
        self.len > self.taken
    }

    /// Returns the number of bytes outside packets.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Skips the first byte, which begins no packet.
    fn skip_one(&mut self, rest: &mut &[u8]) {
        self.skipped += 1;
        *rest = &rest[1..];
    }

    /// Moves bytes to the buffer until it has `len`, or none are left.
    fn take(&mut self, len: usize, rest: &mut &[u8]) {
        let count = rest.len().min(len - self.len);
        let (bytes, behind) = rest.split_at(count);
        self.buffer[self.len..self.len + count].copy_from_slice(bytes);
        self.len += count;
        *rest = behind;
    }

    /// Skips the first byte of the buffer, which begins no packet, up to the next header.
    fn resynchronise(&mut self) {
        let behind = &self.buffer[1..self.len];
        let next = behind.iter().position(|byte| *byte == HEADER);
        let count = next.map_or(self.len, |at| at + 1);
        self.skipped += count as u64;
        self.drop_front(count);
    }

    fn drop_front(&mut self, count: usize) {
        self.buffer.copy_within(count..self.len, 0);
        self.len -= count;
    }
}
