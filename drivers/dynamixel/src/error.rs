use thiserror::Error;
use twinrig_wire::WireError;

use crate::codes::Instruction;

/// A packet that cannot be encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PacketError {
    /// It is too long.
    #[error("a packet of {found} bytes; at most {most} are possible: address fewer servos at once")]
    Length {
        /// Its length \[bytes\].
        found: usize,
        /// The greatest length \[bytes\].
        most: usize,
    },
    /// Protocol 1.0 has addresses and lengths up to 255, and fewer instructions.
    #[error("protocol 1.0 has no {0}")]
    Unsupported(&'static str),
    /// The servos do not have the instruction.
    #[error("the servos do not have the instruction `{0}`")]
    Lacking(Instruction),
}

/// A bus that cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ServoBusError {
    /// Two servos with the same name or identifier.
    #[error("the servos `{first}` and `{second}` have the same name or identifier")]
    Twice {
        /// Name of the one.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// Servos whose positions are in different registers, or whose protocols differ.
    #[error("the servos `{first}` and `{second}` have different protocols or registers")]
    Mixed {
        /// Name of the one.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// A value for a register that the servo does not have.
    #[error("the servo `{servo}` has no register at {address}")]
    Register {
        /// Name of the servo.
        servo: String,
        /// Address.
        address: u16,
    },
    /// A value that does not fit into a register.
    #[error("the servo `{servo}` cannot have {value} in `{register}`: {least} to {greatest} fit")]
    Value {
        /// Name of the servo.
        servo: String,
        /// Name of the register.
        register: &'static str,
        /// The value.
        value: i32,
        /// Least value.
        least: i32,
        /// Greatest value.
        greatest: i32,
    },
    /// An identifier that no servo has.
    #[error("the servo `{servo}` cannot have the identifier {id}")]
    Id {
        /// Name of the servo.
        servo: String,
        /// Identifier.
        id: u8,
    },
    /// Goals or reads that do not fit into a packet.
    #[error("a bus of {servos} servos: {source}")]
    Packet {
        /// Number of servos.
        servos: usize,
        /// The reason.
        source: PacketError,
    },
    /// The transport.
    #[error(transparent)]
    Wire(#[from] WireError),
}
