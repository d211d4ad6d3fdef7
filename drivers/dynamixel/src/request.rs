//! Instructions with their parameters.

use serde::{Deserialize, Serialize};

use crate::codes::{ErrorNumber, Instruction};
use crate::error::PacketError;
use crate::protocol::{Content, Packet, ProtocolVersion};

/// Consecutive registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// Address of the first byte.
    pub address: u16,
    /// Number of bytes.
    pub length: u16,
}

/// Instruction with its parameters.
///
/// ```
/// use twinrig_dynamixel::{ProtocolVersion, Request, Span};
///
/// // Present position of servos 1 and 2 (the example of the manual).
/// let span = Span { address: 132, length: 4 };
/// let request = Request::SyncRead { span, ids: &[1, 2] };
/// let mut bytes = Vec::new();
/// request.encode(ProtocolVersion::Two, ProtocolVersion::BROADCAST, &mut bytes)?;
/// assert_eq!(
///     bytes,
///     [0xff, 0xff, 0xfd, 0, 0xfe, 9, 0, 0x82, 132, 0, 4, 0, 1, 2, 0xce, 0xfa]
/// );
/// # Ok::<(), twinrig_dynamixel::PacketError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request<'p> {
    /// [`Instruction::PING`].
    Ping,
    /// [`Instruction::READ`].
    Read(Span),
    /// [`Instruction::WRITE`].
    Write {
        /// Address of the first byte.
        address: u16,
        /// Bytes.
        data: &'p [u8],
    },
    /// [`Instruction::REG_WRITE`].
    RegWrite {
        /// Address of the first byte.
        address: u16,
        /// Bytes.
        data: &'p [u8],
    },
    /// [`Instruction::ACTION`].
    Action,
    /// [`Instruction::FACTORY_RESET`].
    FactoryReset(Kept),
    /// [`Instruction::REBOOT`].
    Reboot,
    /// [`Instruction::CLEAR`] of the turns: the position is within one turn afterwards.
    ClearTurns,
    /// [`Instruction::SYNC_READ`].
    SyncRead {
        /// Registers.
        span: Span,
        /// Identifiers in the order of the answers.
        ids: &'p [u8],
    },
    /// [`Instruction::FAST_SYNC_READ`].
    FastSyncRead {
        /// Registers.
        span: Span,
        /// Identifiers in the order of the answers.
        ids: &'p [u8],
    },
    /// [`Instruction::SYNC_WRITE`].
    SyncWrite {
        /// Registers.
        span: Span,
        /// Identifier and bytes of each servo.
        data: &'p [u8],
    },
    /// [`Instruction::BULK_READ`].
    BulkRead(BulkReads<'p>),
    /// [`Instruction::FAST_BULK_READ`].
    FastBulkRead(BulkReads<'p>),
    /// [`Instruction::BULK_WRITE`]: identifier, address (2), length (2) and bytes of each servo.
    BulkWrite(&'p [u8]),
}

/// Registers that a factory reset keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// None.
    Nothing,
    /// The identifier.
    Id,
    /// Identifier and baud rate.
    IdAndBaudRate,
}

impl Kept {
    const CODES: [(Self, u8); 3] = [
        (Self::Nothing, 0xff),
        (Self::Id, 0x01),
        (Self::IdAndBaudRate, 0x02),
    ];
}

/// Parameters that confirm [`Request::ClearTurns`].
const CLEAR_TURNS: [u8; 5] = [0x01, 0x44, 0x58, 0x4c, 0x22];

/// Reads of several servos, as bytes of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BulkReads<'p> {
    protocol: ProtocolVersion,
    bytes: &'p [u8],
}

impl<'p> BulkReads<'p> {
    /// Interprets the bytes that [`BulkReads::append`] has made.
    pub fn new(protocol: ProtocolVersion, bytes: &'p [u8]) -> Self {
        Self { protocol, bytes }
    }

    /// Appends the read of a servo to `bytes`.
    ///
    /// # Errors
    /// [`PacketError::Unsupported`] if protocol 1.0 cannot express it.
    pub fn append(
        protocol: ProtocolVersion,
        id: u8,
        span: Span,
        bytes: &mut Vec<u8>,
    ) -> Result<(), PacketError> {
        match protocol {
            ProtocolVersion::One => bytes.extend([narrow(span.length)?, id, narrow(span.address)?]),
            ProtocolVersion::Two => {
                bytes.push(id);
                bytes.extend(span.address.to_le_bytes());
                bytes.extend(span.length.to_le_bytes());
            }
        }
        Ok(())
    }

    /// Returns servos and registers, in the order of the answers.
    pub fn iter(self) -> impl Iterator<Item = (u8, Span)> + use<'p> {
        let size = match self.protocol {
            ProtocolVersion::One => 3,
            ProtocolVersion::Two => 5,
        };
        self.bytes.chunks_exact(size).map(|entry| match *entry {
            [length, id, address] => {
                let (address, length) = (address.into(), length.into());
                (id, Span { address, length })
            }
            [id, a, b, c, d] => {
                let [address, length] = [[a, b], [c, d]].map(u16::from_le_bytes);
                (id, Span { address, length })
            }
            _ => unreachable!("entries have three or five bytes"),
        })
    }
}

/// Narrows an address or a length for protocol 1.0.
fn narrow(value: u16) -> Result<u8, PacketError> {
    u8::try_from(value).map_err(|_| PacketError::Unsupported("addresses and lengths above 255"))
}

impl<'p> Request<'p> {
    /// Returns the instruction.
    pub const fn instruction(&self) -> Instruction {
        match self {
            Self::Ping => Instruction::PING,
            Self::Read(_) => Instruction::READ,
            Self::Write { .. } => Instruction::WRITE,
            Self::RegWrite { .. } => Instruction::REG_WRITE,
            Self::Action => Instruction::ACTION,
            Self::FactoryReset(_) => Instruction::FACTORY_RESET,
            Self::Reboot => Instruction::REBOOT,
            Self::ClearTurns => Instruction::CLEAR,
            Self::SyncRead { .. } => Instruction::SYNC_READ,
            Self::FastSyncRead { .. } => Instruction::FAST_SYNC_READ,
            Self::SyncWrite { .. } => Instruction::SYNC_WRITE,
            Self::BulkRead(_) => Instruction::BULK_READ,
            Self::FastBulkRead(_) => Instruction::FAST_BULK_READ,
            Self::BulkWrite(_) => Instruction::BULK_WRITE,
        }
    }

    /// Appends the packet of the request to the servo `id`, or to all, to `bytes`.
    ///
    /// # Errors
    /// [`PacketError`] if the protocol cannot express it; then `bytes` is unchanged.
    pub fn encode(
        &self,
        protocol: ProtocolVersion,
        id: u8,
        bytes: &mut Vec<u8>,
    ) -> Result<(), PacketError> {
        protocol.write(id, bytes, |content| {
            content.push(&[self.instruction().0]);
            self.write_parameters(protocol, content)
        })
    }

    fn write_parameters(
        &self,
        protocol: ProtocolVersion,
        content: &mut Content<'_>,
    ) -> Result<(), PacketError> {
        let number = |value: u16, content: &mut Content<'_>| {
            match protocol {
                ProtocolVersion::One => content.push(&[narrow(value)?]),
                ProtocolVersion::Two => content.push(&value.to_le_bytes()),
            }
            Ok(())
        };
        match *self {
            Self::Ping | Self::Action | Self::Reboot => {}
            Self::Read(span) => {
                number(span.address, content)?;
                number(span.length, content)?;
            }
            Self::Write { address, data } | Self::RegWrite { address, data } => {
                number(address, content)?;
                content.push(data);
            }
            Self::FactoryReset(Kept::Id | Kept::IdAndBaudRate)
                if protocol == ProtocolVersion::One =>
            {
                return Err(PacketError::Unsupported("partial factory reset"));
            }
            Self::ClearTurns if protocol == ProtocolVersion::One => {
                return Err(PacketError::Unsupported("clear"));
            }
            Self::FactoryReset(kept) => {
                let code = Kept::CODES.iter().find(|(known, _)| *known == kept);
                if let (ProtocolVersion::Two, Some((_, code))) = (protocol, code) {
                    content.push(&[*code]);
                }
            }
            Self::ClearTurns => content.push(&CLEAR_TURNS),
            Self::FastSyncRead { .. } if protocol == ProtocolVersion::One => {
                return Err(PacketError::Unsupported("fast sync read"));
            }
            Self::FastBulkRead(_) if protocol == ProtocolVersion::One => {
                return Err(PacketError::Unsupported("fast bulk read"));
            }
            Self::SyncRead { span, ids: data }
            | Self::FastSyncRead { span, ids: data }
            | Self::SyncWrite { span, data } => {
                number(span.address, content)?;
                number(span.length, content)?;
                content.push(data);
            }
            Self::BulkRead(reads) | Self::FastBulkRead(reads) => {
                // Protocol 1.0 begins the list with a zero.
                if protocol == ProtocolVersion::One {
                    content.push(&[0]);
                }
                content.push(reads.bytes);
            }
            Self::BulkWrite(data) => {
                if protocol == ProtocolVersion::One {
                    return Err(PacketError::Unsupported("bulk write"));
                }
                content.push(data);
            }
        }
        Ok(())
    }

    /// Interprets a packet to servos.
    ///
    /// # Errors
    /// [`ErrorNumber::INSTRUCTION`] for an instruction that is not defined,
    /// [`ErrorNumber::DATA_LENGTH`] for parameters of another length.
    pub fn decode(protocol: ProtocolVersion, packet: &Packet<'p>) -> Result<Self, ErrorNumber> {
        let mut rest = packet.parameters;
        let mut number = || -> Result<u16, ErrorNumber> {
            let (value, behind) = match (protocol, rest) {
                (ProtocolVersion::One, [value, behind @ ..]) => (u16::from(*value), behind),
                (ProtocolVersion::Two, [low, high, behind @ ..]) => {
                    (u16::from_le_bytes([*low, *high]), behind)
                }
                _ => return Err(ErrorNumber::DATA_LENGTH),
            };
            rest = behind;
            Ok(value)
        };
        let two = protocol == ProtocolVersion::Two;
        let bulk = |bytes| BulkReads { protocol, bytes };
        Ok(match Instruction(packet.code) {
            Instruction::PING => Self::Ping,
            Instruction::READ => Self::Read(Span {
                address: number()?,
                length: number()?,
            }),
            Instruction::WRITE => Self::Write {
                address: number()?,
                data: rest,
            },
            Instruction::REG_WRITE => Self::RegWrite {
                address: number()?,
                data: rest,
            },
            Instruction::ACTION => Self::Action,
            Instruction::FACTORY_RESET => Self::FactoryReset(kept(protocol, rest)?),
            Instruction::REBOOT => Self::Reboot,
            Instruction::CLEAR if two => match rest {
                _ if rest == CLEAR_TURNS => Self::ClearTurns,
                _ => return Err(ErrorNumber::DATA_RANGE),
            },
            code @ (Instruction::SYNC_READ | Instruction::SYNC_WRITE) => {
                let (address, length) = (number()?, number()?);
                let span = Span { address, length };
                match code {
                    Instruction::SYNC_READ => Self::SyncRead { span, ids: rest },
                    _ => Self::SyncWrite { span, data: rest },
                }
            }
            Instruction::FAST_SYNC_READ if two => Self::FastSyncRead {
                span: Span {
                    address: number()?,
                    length: number()?,
                },
                ids: rest,
            },
            Instruction::BULK_READ if two => Self::BulkRead(bulk(rest)),
            Instruction::BULK_READ => match rest {
                [0, reads @ ..] => Self::BulkRead(bulk(reads)),
                _ => return Err(ErrorNumber::DATA_RANGE),
            },
            Instruction::FAST_BULK_READ if two => Self::FastBulkRead(bulk(rest)),
            Instruction::BULK_WRITE if two => Self::BulkWrite(rest),
            _ => return Err(ErrorNumber::INSTRUCTION),
        })
    }
}

/// Returns the registers that a factory reset keeps.
fn kept(protocol: ProtocolVersion, parameters: &[u8]) -> Result<Kept, ErrorNumber> {
    match (protocol, parameters) {
        (ProtocolVersion::One, _) => Ok(Kept::Nothing),
        (ProtocolVersion::Two, [code, ..]) => {
            let known = Kept::CODES.iter().find(|(_, known)| known == code);
            known.map(|(kept, _)| *kept).ok_or(ErrorNumber::DATA_RANGE)
        }
        (ProtocolVersion::Two, []) => Err(ErrorNumber::DATA_LENGTH),
    }
}

/// Returns the bytes that a sync write has for the servo `id`.
pub(crate) fn of_servo(span: Span, data: &[u8], id: u8) -> Option<&[u8]> {
    let entries = data.chunks_exact(1 + usize::from(span.length));
    let mut entries = entries.filter_map(|entry| entry.split_first());
    entries.find(|(of, _)| **of == id).map(|(_, bytes)| bytes)
}

/// Returns address and bytes that a bulk write has for the servo `id`.
pub(crate) fn bulk_of_servo(mut data: &[u8], id: u8) -> Option<(u16, &[u8])> {
    while let [of, a, b, c, d, behind @ ..] = data {
        let [address, length] = [[*a, *b], [*c, *d]].map(u16::from_le_bytes);
        let (bytes, rest) = behind.split_at_checked(length.into())?;
        if *of == id {
            return Some((address, bytes));
        }
        data = rest;
    }
    None
}
