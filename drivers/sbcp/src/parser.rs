use serde::{Deserialize, Serialize};

use crate::codes::{HEADER, PACKET_MAX};
use crate::packet::{Packet, packet_len};

/// Finds packets in a stream of bytes that comes in pieces of any length, with anything between them.
///
/// Wherever a header byte was taken for the beginning of a packet and none follows, the search goes on
/// behind that one byte: no packet is lost to garbage before it, unless the garbage happens to have the
/// right checksum. It may be *late*, though: a header in the garbage is believed for up to
/// [`PACKET_MAX`] bytes. So a packet is found at the latest when `PACKET_MAX - 1` bytes have come behind the
/// garbage's last one, or when [`Parser::give_up`] says that no more will come.
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
    /// Bytes from a header on that may still become a packet.
    held: [u8; PACKET_MAX],
    len: usize,
    /// How many of them were handed out as a packet by the last call.
    taken: usize,
    skipped: u64,
    /// Class and id of the last packet whose checksum was wrong.
    damaged: Option<(u8, u8)>,
}

/// What a stretch of bytes begins with.
enum Beginning {
    Packet(usize),
    Garbage,
    /// What is a packet but for its checksum, from that class and id.
    Damaged(u8, u8),
    /// Nothing yet; so many bytes are needed to know more.
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
    /// The next packet, if its end is there: takes from `rest` what it has looked at. To be called until it
    /// gives nothing; all bytes are taken then.
    pub fn next<'p, 'b: 'p>(&'p mut self, rest: &mut &'b [u8]) -> Option<Packet<'p>> {
        self.drop_held(self.taken);
        self.taken = 0;
        while self.len > 0 {
            match beginning(&self.held[..self.len.min(PACKET_MAX)]) {
                Beginning::Packet(len) => {
                    self.taken = len;
                    return Packet::new(&self.held[..len]).ok();
                }
                Beginning::Garbage => self.search_held(),
                Beginning::Damaged(class, id) => {
                    self.damaged = Some((class, id));
                    self.search_held();
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

    /// No more bytes will come that belong to those that were seen: gives a packet that was hidden behind
    /// something which began like one. To be called until it gives nothing; the parser is empty then.
    pub fn give_up(&mut self) -> Option<Packet<'_>> {
        self.drop_held(self.taken);
        self.taken = 0;
        while self.len > 0 {
            if let Beginning::Packet(len) = beginning(&self.held[..self.len]) {
                self.taken = len;
                return Packet::new(&self.held[..len]).ok();
            }
            self.search_held();
        }
        None
    }

    /// Forgets what was seen.
    pub fn reset(&mut self) {
        self.skipped += (self.len - self.taken) as u64;
        self.len = 0;
        self.taken = 0;
        self.damaged = None;
    }

    /// Class and id of what was a packet but for its checksum, the last since [`Parser::reset`].
    pub fn damaged(&self) -> Option<(u8, u8)> {
        self.damaged
    }

    /// Whether it has seen what may be the beginning of a packet.
    pub fn is_amid(&self) -> bool {
        self.len > self.taken
    }

    /// How many bytes belonged to no packet, so far.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The first byte begins no packet.
    fn skip_one(&mut self, rest: &mut &[u8]) {
        self.skipped += 1;
        *rest = &rest[1..];
    }

    /// Moves bytes over until `len` are held, or there are no more.
    fn take(&mut self, len: usize, rest: &mut &[u8]) {
        let count = rest.len().min(len - self.len);
        let (bytes, behind) = rest.split_at(count);
        self.held[self.len..self.len + count].copy_from_slice(bytes);
        self.len += count;
        *rest = behind;
    }

    /// The first byte held begins no packet: goes on at the next header.
    fn search_held(&mut self) {
        let behind = &self.held[1..self.len];
        let next = behind.iter().position(|byte| *byte == HEADER);
        let count = next.map_or(self.len, |at| at + 1);
        self.skipped += count as u64;
        self.drop_held(count);
    }

    fn drop_held(&mut self, count: usize) {
        self.held.copy_within(count..self.len, 0);
        self.len -= count;
    }
}
