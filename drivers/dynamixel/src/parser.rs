use serde::{Deserialize, Serialize};

use crate::protocol::{Beginning, Packet, ProtocolVersion};

/// Finds packets in a stream of bytes that is received in pieces of any length.
///
/// Where no packet begins, or its checksum is wrong, the search continues one byte behind.
///
/// ```
/// use twinrig_dynamixel::{Instruction, Parser, ProtocolVersion, Received};
///
/// let mut parser = Parser::new(ProtocolVersion::Two);
/// parser.push(&[0x17, 0xff, 0xff, 0xfd, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19]);
/// assert!(parser.next_packet().is_none());
/// parser.push(&[0x4e]);
/// let Some(Received::Packet(packet)) = parser.next_packet() else { panic!() };
/// assert_eq!((packet.id, packet.code), (1, Instruction::PING.0));
/// assert_eq!(parser.skipped(), 1);
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Parser {
    protocol: ProtocolVersion,
    bytes: Vec<u8>,
    /// Number of bytes processed.
    consumed: usize,
    skipped: u64,
    /// Parameters of the last packet.
    #[serde(skip)]
    parameters: Vec<u8>,
}

/// What a parser finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received<'p> {
    /// A packet.
    Packet(Packet<'p>),
    /// What seems to be a packet with this identifier, whose checksum is wrong.
    Damaged {
        /// Identifier.
        id: u8,
    },
}

impl Parser {
    /// Creates a parser.
    pub fn new(protocol: ProtocolVersion) -> Self {
        Self {
            protocol,
            bytes: Vec::new(),
            consumed: 0,
            skipped: 0,
            parameters: Vec::new(),
        }
    }

    /// Appends received bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.consumed);
        self.consumed = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// Returns the next packet, or damage; none until more bytes are pushed.
    pub fn next_packet(&mut self) -> Option<Received<'_>> {
        loop {
            let rest = &self.bytes[self.consumed..];
            match self.protocol.beginning(rest) {
                Beginning::Packet(length) => {
                    let frame = self.consumed..self.consumed + length;
                    self.consumed = frame.end;
                    let frame = &self.bytes[frame];
                    let packet = self.protocol.decode(frame, &mut self.parameters)?;
                    return Some(Received::Packet(packet));
                }
                Beginning::Damaged => {
                    let id = rest[self.protocol.id_place()];
                    self.skip();
                    return Some(Received::Damaged { id });
                }
                Beginning::Garbage => self.skip(),
                Beginning::Missing(_) => {
                    // So that a saved parser has the bytes that matter only.
                    self.bytes.drain(..self.consumed);
                    self.consumed = 0;
                    return None;
                }
            }
        }
    }

    fn skip(&mut self) {
        self.consumed += 1;
        self.skipped += 1;
    }

    /// Returns the minimum number of bytes missing for the next packet; never zero.
    pub fn missing(&self) -> usize {
        match self.protocol.beginning(&self.bytes[self.consumed..]) {
            Beginning::Missing(count) => count.max(1),
            _ => 1,
        }
    }

    /// Whether no packet has begun.
    pub fn is_empty(&self) -> bool {
        self.consumed == self.bytes.len()
    }

    /// Discards the beginning of a packet, which counts as skipped.
    pub fn reset(&mut self) {
        self.skipped += (self.bytes.len() - self.consumed) as u64;
        self.bytes.clear();
        self.consumed = 0;
    }

    /// Returns the number of bytes outside packets.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}
