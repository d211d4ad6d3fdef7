use std::ops::Deref;

use serde::{Deserialize, Serialize};

use crate::codes::{
    BROADCAST, ErrorCode, HEADER, Instruction, LENGTH_OVERHEAD, OVERHEAD, PACKET_MAX, PAYLOAD_MAX,
};
use crate::error::SbcpError;
use crate::registers::Width;

/// Sum of all bytes modulo 256. For a packet it is applied to the bytes between header and
/// checksum.
pub(crate) fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// Returns the length of the whole packet \[B\] from its length byte; None if the length byte is
/// invalid.
pub(crate) fn packet_len(length: u8) -> Option<usize> {
    let len = usize::from(length) + OVERHEAD - usize::from(LENGTH_OVERHEAD);
    (length >= LENGTH_OVERHEAD && len <= PACKET_MAX).then_some(len)
}

/// Returns class and id of the device that a transmission addresses or comes from, if by its first
/// four bytes and its length it is exactly one packet, and no broadcast: for
/// `twinrig_wire::Rs485::with_packets`.
pub fn recipient(bytes: &[u8]) -> Option<u16> {
    let &[HEADER, class, id, length, ..] = bytes else {
        return None;
    };
    let address = Address::new(class, id).ok()?;
    let whole = packet_len(length) == Some(bytes.len()) && !address.is_broadcast();
    whole.then(|| address.word())
}

/// Packet in its raw form: framed bytes with a valid checksum. [`Request`] and [`Response`]
/// interpret it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a>(&'a [u8]);

impl<'a> Packet<'a> {
    /// Checks that the bytes are exactly one packet.
    ///
    /// # Errors
    /// [`SbcpError::NotFramed`], [`SbcpError::Length`] or [`SbcpError::Checksum`].
    pub fn new(bytes: &'a [u8]) -> Result<Self, SbcpError> {
        let &[HEADER, _, _, length, .., found] = bytes else {
            return Err(SbcpError::NotFramed { bytes: bytes.len() });
        };
        let len = packet_len(length).ok_or(SbcpError::Length { length })?;
        if len != bytes.len() {
            return Err(SbcpError::NotFramed { bytes: bytes.len() });
        }
        let sum = checksum(&bytes[1..len - 1]);
        if sum == found {
            Ok(Self(bytes))
        } else {
            Err(SbcpError::Checksum { found, sum })
        }
    }

    /// Returns all bytes.
    pub fn bytes(&self) -> &'a [u8] {
        self.0
    }

    /// Returns the class of the destination of a request or of the source of a response.
    pub fn class(&self) -> u8 {
        self.0[1]
    }

    /// Returns the id of the destination of a request or of the source of a response.
    pub fn id(&self) -> u8 {
        self.0[2]
    }

    /// Returns the fifth byte: a request's instruction, a response's error.
    pub fn code(&self) -> u8 {
        self.0[4]
    }

    /// Returns the payload.
    pub fn payload(&self) -> &'a [u8] {
        &self.0[5..self.0.len() - 1]
    }
}

/// Destination of a request, or source of a response: never the header byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Address {
    class: u8,
    id: u8,
}

impl Address {
    /// The device of that class and id; [`BROADCAST`] means all.
    ///
    /// # Errors
    /// [`SbcpError::Address`] if class or id is the header byte.
    pub const fn new(class: u8, id: u8) -> Result<Self, SbcpError> {
        if class == HEADER || id == HEADER {
            Err(SbcpError::Address { class, id })
        } else {
            Ok(Self { class, id })
        }
    }

    /// Class of the device.
    pub const fn class(self) -> u8 {
        self.class
    }

    /// Id within the class.
    pub const fn id(self) -> u8 {
        self.id
    }

    /// Class and id in one number.
    pub(crate) const fn word(self) -> u16 {
        u16::from_be_bytes([self.class, self.id])
    }

    /// Whether it is a broadcast address, which is not answered.
    pub const fn is_broadcast(self) -> bool {
        self.class == BROADCAST || self.id == BROADCAST
    }

    /// Whether a request to this address is for `device`.
    pub const fn is_for(self, device: Self) -> bool {
        (self.class == device.class || self.class == BROADCAST)
            && (self.id == device.id || self.id == BROADCAST)
    }
}

/// Payload of a packet: at most [`PAYLOAD_MAX`] bytes.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(try_from = "Vec<u8>", into = "Vec<u8>")]
pub struct Payload {
    bytes: [u8; PAYLOAD_MAX],
    len: u8,
}

impl Payload {
    /// A payload of these bytes.
    ///
    /// # Errors
    /// [`SbcpError::Payload`] if there are too many.
    pub fn new(bytes: &[u8]) -> Result<Self, SbcpError> {
        let mut payload = Self::default();
        let len = bytes.len();
        let Some(room) = payload.bytes.get_mut(..len) else {
            return Err(SbcpError::Payload { len });
        };
        room.copy_from_slice(bytes);
        #[expect(clippy::cast_possible_truncation, reason = "at most PAYLOAD_MAX")]
        let len = len as u8;
        payload.len = len;
        Ok(payload)
    }

    /// Value of a register, low byte first.
    pub(crate) fn of_register(width: Width, value: u16) -> Self {
        let mut payload = Self::default();
        [payload.bytes[0], payload.bytes[1]] = value.to_le_bytes();
        payload.len = match width {
            Width::U8 => 1,
            Width::U16 => 2,
        };
        payload
    }

    /// Payload of a checked packet, which fits.
    fn of(packet: &Packet<'_>) -> Self {
        let mut payload = Self::default();
        let bytes = packet.payload();
        payload.bytes[..bytes.len()].copy_from_slice(bytes);
        payload.len = packet.0[3] - LENGTH_OVERHEAD;
        payload
    }
}

impl PartialEq for Payload {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Eq for Payload {}

impl Deref for Payload {
    type Target = [u8];
    fn deref(&self) -> &[u8] {
        // The length is checked at construction.
        &self.bytes[..usize::from(self.len)]
    }
}

impl TryFrom<Vec<u8>> for Payload {
    type Error = SbcpError;
    fn try_from(bytes: Vec<u8>) -> Result<Self, SbcpError> {
        Self::new(&bytes)
    }
}

impl From<Payload> for Vec<u8> {
    fn from(payload: Payload) -> Self {
        payload.to_vec()
    }
}

/// Request: sent by the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// Destination.
    pub to: Address,
    /// Instruction.
    pub instruction: Instruction,
    /// Payload.
    pub payload: Payload,
}

impl Request {
    /// A request with these bytes as payload.
    ///
    /// # Errors
    /// [`SbcpError::Payload`] if there are too many.
    pub fn new(to: Address, instruction: Instruction, payload: &[u8]) -> Result<Self, SbcpError> {
        Ok(Self {
            to,
            instruction,
            payload: Payload::new(payload)?,
        })
    }

    /// Interprets a packet as a request.
    ///
    /// # Errors
    /// [`SbcpError::Address`] if its address is invalid.
    pub fn parse(packet: &Packet<'_>) -> Result<Self, SbcpError> {
        Ok(Self {
            to: Address::new(packet.class(), packet.id())?,
            instruction: Instruction(packet.code()),
            payload: Payload::of(packet),
        })
    }

    /// Returns the length of the packet \[B\].
    pub fn packet_len(&self) -> usize {
        self.payload.len() + OVERHEAD
    }

    /// Appends the packet.
    pub fn emit(&self, bytes: &mut Vec<u8>) {
        emit(self.to, self.instruction.0, &self.payload, bytes);
    }
}

/// Response: sent by a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Response {
    from: Address,
    /// Result of the instruction.
    pub error: ErrorCode,
    /// Payload.
    pub payload: Payload,
}

impl Response {
    /// A response with these bytes as payload.
    ///
    /// # Errors
    /// [`SbcpError::Payload`] if there are too many, [`SbcpError::Address`] if the source is a
    /// broadcast address.
    pub fn new(from: Address, error: ErrorCode, payload: &[u8]) -> Result<Self, SbcpError> {
        if from.is_broadcast() {
            let Address { class, id } = from;
            return Err(SbcpError::Address { class, id });
        }
        Ok(Self {
            from,
            error,
            payload: Payload::new(payload)?,
        })
    }

    /// Interprets a packet as a response.
    ///
    /// # Errors
    /// [`SbcpError::Address`] if its address is invalid or a broadcast address.
    pub fn parse(packet: &Packet<'_>) -> Result<Self, SbcpError> {
        let from = Address::new(packet.class(), packet.id())?;
        if from.is_broadcast() {
            let Address { class, id } = from;
            return Err(SbcpError::Address { class, id });
        }
        Ok(Self {
            from,
            error: ErrorCode(packet.code()),
            payload: Payload::of(packet),
        })
    }

    /// Returns the source: one device.
    pub fn from(&self) -> Address {
        self.from
    }

    /// Returns the length of the packet \[B\].
    pub fn packet_len(&self) -> usize {
        self.payload.len() + OVERHEAD
    }

    /// Appends the packet.
    pub fn emit(&self, bytes: &mut Vec<u8>) {
        emit(self.from, self.error.0, &self.payload, bytes);
    }
}

/// Appends a packet.
pub(crate) fn emit(address: Address, code: u8, payload: &Payload, bytes: &mut Vec<u8>) {
    let Address { class, id } = address;
    let start = bytes.len() + 1;
    bytes.extend_from_slice(&[HEADER, class, id, payload.len + LENGTH_OVERHEAD, code]);
    bytes.extend_from_slice(payload);
    let sum = checksum(&bytes[start..]);
    bytes.push(sum);
}
