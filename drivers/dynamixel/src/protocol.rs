//! Packets as bytes: headers, lengths, byte stuffing and checksums.

use crc::{CRC_16_UMTS, Crc};
use serde::{Deserialize, Serialize};
use twinrig_wire::FrameMatch;

use crate::codes::Instruction;
use crate::error::PacketError;

pub(crate) static CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_UMTS);
const HEADER_1: [u8; 2] = [0xff; 2];
/// Header, and the reserved byte.
pub(crate) const HEADER_2: [u8; 4] = [0xff, 0xff, 0xfd, 0x00];
/// The pattern that is stuffed by a further byte.
const PATTERN: [u8; 3] = [0xff, 0xff, 0xfd];
/// Bytes before those that the length counts.
const START_1: usize = 4;
pub(crate) const START_2: usize = 7;
/// Smallest lengths: code and checksum.
const LENGTH_MIN_1: usize = 2;
const LENGTH_MIN_2: usize = 3;

/// Version of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ProtocolVersion {
    /// 1.0, of AX, DX and RX; also that of Feetech's servos. A packet is `FF FF`, identifier,
    /// length, code, parameters, and the inverted sum of all bytes from the identifier on.
    One,
    /// 2.0, of X, P and MX. A packet is `FF FF FD 00`, identifier, length (2), code, parameters,
    /// and a CRC (2) of all bytes before it. Within code and parameters `FF FF FD` is followed by
    /// a further `FD`, which the length counts.
    Two,
}

/// Packet without header, byte stuffing and checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'p> {
    /// Identifier of the servo that is addressed or answers.
    pub id: u8,
    /// [`Instruction`]; in answers of protocol 1.0 the error.
    pub code: u8,
    /// Parameters; in answers of protocol 2.0 after the error.
    pub parameters: &'p [u8],
}

/// Answer of a servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status<'p> {
    /// Identifier of the servo.
    pub id: u8,
    /// Error: bits of protocol 1.0 or of Feetech, or an [`crate::ErrorNumber`] with the alert bit.
    pub error: u8,
    /// Data.
    pub data: &'p [u8],
}

/// The bytes at the front of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beginning {
    /// A packet of this many bytes.
    Packet(usize),
    /// A packet with a wrong checksum.
    Damaged,
    /// A possible beginning of a packet; at least this many bytes are missing.
    Missing(usize),
    /// No packet begins here.
    Garbage,
}

impl ProtocolVersion {
    /// Identifier to which all servos listen.
    pub const BROADCAST: u8 = 0xfe;

    /// Returns the greatest identifier of a servo.
    pub const fn id_max(self) -> u8 {
        match self {
            Self::One => 0xfd,
            Self::Two => 0xfc,
        }
    }

    /// Returns the greatest length of a packet \[bytes\]: what the length byte of protocol 1.0
    /// counts; of protocol 2.0, the buffers of the vendor's library (`dynamixel_sdk` 4.1).
    pub const fn packet_max(self) -> usize {
        match self {
            Self::One => START_1 + 0xff,
            Self::Two => 1024,
        }
    }

    /// Returns the place of the identifier in a packet.
    pub(crate) const fn id_place(self) -> usize {
        match self {
            Self::One => HEADER_1.len(),
            Self::Two => HEADER_2.len(),
        }
    }

    /// Returns the greatest length of an answer with so many bytes of data, stuffing included
    /// \[bytes\].
    pub(crate) const fn answer_max(self, data: usize) -> usize {
        match self {
            Self::One => START_1 + LENGTH_MIN_1 + data,
            // One more where three bytes are those of the header.
            Self::Two => START_2 + LENGTH_MIN_2 + 1 + data + (1 + data) / 3,
        }
    }

    /// Returns the address of the packet of which a transmission consists, for
    /// [`twinrig_wire::Rs485::with_packets`]: the identifier, to which 0x100 is added for an answer
    /// of protocol 2.0. None if it is not exactly one intact packet.
    pub fn packet_address(self, bytes: &[u8]) -> Option<u16> {
        let Beginning::Packet(length) = self.beginning(bytes) else {
            return None;
        };
        let id = *bytes.get(self.id_place())?;
        let is_answer = self == Self::Two && bytes.get(START_2) == Some(&Instruction::STATUS.0);
        let address = if is_answer {
            self.answer_address(id)
        } else {
            id.into()
        };
        (length == bytes.len()).then_some(address)
    }

    /// Returns the address of the answers of a servo; protocol 1.0 does not tell them from
    /// instructions.
    pub(crate) fn answer_address(self, id: u8) -> u16 {
        match self {
            Self::One => id.into(),
            Self::Two => 0x100 | u16::from(id),
        }
    }

    /// Appends a packet to `bytes`.
    ///
    /// # Errors
    /// [`PacketError::Length`] if it is too long; then `bytes` is unchanged.
    pub fn encode(self, packet: &Packet<'_>, bytes: &mut Vec<u8>) -> Result<(), PacketError> {
        self.write(packet.id, bytes, |content| {
            content.push(&[packet.code]);
            content.push(packet.parameters);
            Ok(())
        })
    }

    /// Appends the answer of a servo to `bytes`.
    ///
    /// # Errors
    /// As [`ProtocolVersion::encode`].
    pub fn encode_status(
        self,
        status: &Status<'_>,
        bytes: &mut Vec<u8>,
    ) -> Result<(), PacketError> {
        self.write(status.id, bytes, |content| {
            if self == Self::Two {
                content.push(&[Instruction::STATUS.0]);
            }
            content.push(&[status.error]);
            content.push(status.data);
            Ok(())
        })
    }

    /// Appends a packet to `bytes` whose code and parameters `write` writes.
    ///
    /// # Errors
    /// Those of `write`, and [`PacketError::Length`]; then `bytes` is unchanged.
    pub(crate) fn write(
        self,
        id: u8,
        bytes: &mut Vec<u8>,
        write: impl FnOnce(&mut Content<'_>) -> Result<(), PacketError>,
    ) -> Result<(), PacketError> {
        let start = bytes.len();
        match self {
            Self::One => {
                bytes.extend(HEADER_1);
                bytes.extend([id, 0]);
            }
            Self::Two => {
                bytes.extend(HEADER_2);
                bytes.extend([id, 0, 0]);
            }
        }
        let behind_length = bytes.len();
        let mut content = Content {
            stuffs: self == Self::Two,
            last: [0; 3],
            bytes,
        };
        let written = write(&mut content);
        let checksum = if self == Self::Two { 2 } else { 1 };
        let length = bytes.len() - behind_length + checksum;
        let found = bytes.len() - start + checksum;
        let checked = written.and_then(|()| match self.packet_max() {
            most if found > most => Err(PacketError::Length { found, most }),
            _ => Ok(()),
        });
        if checked.is_err() {
            bytes.truncate(start);
            return checked;
        }
        let [low, high, ..] = length.to_le_bytes();
        match self {
            Self::One => {
                bytes[behind_length - 1] = low;
                bytes.push(sum(&bytes[start + HEADER_1.len()..]));
            }
            Self::Two => {
                bytes[behind_length - 2..behind_length].copy_from_slice(&[low, high]);
                let crc = CRC.checksum(&bytes[start..]);
                bytes.extend(crc.to_le_bytes());
            }
        }
        Ok(())
    }

    /// Matches a packet with a valid checksum at the front of a stream; see
    /// [`twinrig_wire::Framer`].
    pub fn match_frame(self, front: &[u8]) -> FrameMatch {
        match self.beginning(front) {
            Beginning::Packet(length) => FrameMatch::Frame(length),
            Beginning::Missing(count) => FrameMatch::Missing(count),
            Beginning::Damaged | Beginning::Garbage => FrameMatch::Garbage,
        }
    }

    /// Returns what the bytes at the front of a stream are.
    pub(crate) fn beginning(self, front: &[u8]) -> Beginning {
        let (least, header): (_, &[u8]) = match self {
            Self::One => (START_1 + LENGTH_MIN_1, &HEADER_1),
            Self::Two => (START_2 + LENGTH_MIN_2, &HEADER_2),
        };
        if front
            .iter()
            .zip(header)
            .any(|(byte, header)| byte != header)
        {
            return Beginning::Garbage;
        }
        // FF is no identifier: in protocol 1.0 the header begins a byte later.
        if front.get(header.len()).is_some_and(|id| *id == 0xff) {
            return Beginning::Garbage;
        }
        let (start, length) = match (self, front) {
            (Self::One, [_, _, _, length, ..]) => (START_1, usize::from(*length)),
            (Self::Two, [_, _, _, _, _, low, high, ..]) => {
                (START_2, usize::from(u16::from_le_bytes([*low, *high])))
            }
            _ => return Beginning::Missing(least - front.len()),
        };
        let length = start + length;
        if !(least..=self.packet_max()).contains(&length) {
            return Beginning::Garbage;
        }
        let Some(packet) = front.get(..length) else {
            return Beginning::Missing(length - front.len());
        };
        if self.has_checksum(packet) {
            Beginning::Packet(length)
        } else {
            Beginning::Damaged
        }
    }

    fn has_checksum(self, packet: &[u8]) -> bool {
        match (self, packet) {
            (Self::One, [_, _, content @ .., checksum]) => sum(content) == *checksum,
            (Self::Two, [content @ .., low, high]) => {
                CRC.checksum(content) == u16::from_le_bytes([*low, *high])
            }
            _ => false,
        }
    }

    /// Decodes a packet that [`ProtocolVersion::match_frame`] has found; `parameters` is a buffer.
    /// Returns none if there are too few bytes.
    pub fn decode<'p>(self, frame: &'p [u8], parameters: &'p mut Vec<u8>) -> Option<Packet<'p>> {
        match (self, frame) {
            (Self::One, [_, _, id, _, code, rest @ .., _]) => Some(Packet {
                id: *id,
                code: *code,
                parameters: rest,
            }),
            // The common answer to a fast read is not stuffed.
            (Self::Two, [_, _, _, _, Self::BROADCAST, _, _, code, rest @ .., _, _])
                if *code == Instruction::STATUS.0 =>
            {
                Some(Packet {
                    id: Self::BROADCAST,
                    code: *code,
                    parameters: rest,
                })
            }
            (Self::Two, [_, _, _, _, id, _, _, code, rest @ .., _, _]) => {
                parameters.clear();
                // The code may be the first byte of a pattern.
                let mut last = [0, 0, *code];
                for &byte in rest {
                    let stuffed = last == PATTERN && byte == PATTERN[2];
                    if !stuffed {
                        parameters.push(byte);
                    }
                    last = [last[1], last[2], byte];
                }
                Some(Packet {
                    id: *id,
                    code: *code,
                    parameters,
                })
            }
            _ => None,
        }
    }
}

impl<'p> Packet<'p> {
    /// Returns the packet as an answer; none if it is not one. A packet of protocol 1.0 does not
    /// tell whether it is.
    pub fn status(&self, protocol: ProtocolVersion) -> Option<Status<'p>> {
        let (error, data) = match protocol {
            ProtocolVersion::One => (self.code, self.parameters),
            ProtocolVersion::Two if self.code == Instruction::STATUS.0 => {
                let (error, data) = self.parameters.split_first()?;
                (*error, data)
            }
            ProtocolVersion::Two => return None,
        };
        Some(Status {
            id: self.id,
            error,
            data,
        })
    }
}

/// Returns the checksum of protocol 1.0.
fn sum(content: &[u8]) -> u8 {
    !content.iter().copied().fold(0, u8::wrapping_add)
}

/// Writer of code and parameters, which stuffs them.
pub(crate) struct Content<'b> {
    bytes: &'b mut Vec<u8>,
    stuffs: bool,
    last: [u8; 3],
}

impl Content<'_> {
    /// Appends bytes.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        if !self.stuffs {
            self.bytes.extend_from_slice(bytes);
            return;
        }
        for &byte in bytes {
            self.bytes.push(byte);
            self.last = [self.last[1], self.last[2], byte];
            if self.last == PATTERN {
                self.bytes.push(PATTERN[2]);
            }
        }
    }
}
