//! Bytes, lengths and codes: the single table of values that are not published. The thesis (section
//! 5.3.1.3, figure 5.5) gives the order of the bytes and the rule of the checksum; the values are
//! ASSUMED and to be replaced here.

use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

/// First byte of every packet. ASSUMED.
pub const HEADER: u8 = 0xFF;
/// Bytes of a packet besides its payload: header, class, id, length, instruction or error,
/// checksum.
pub const OVERHEAD: usize = 6;
/// Maximum length of a packet \[B\]: the size of the boards' buffers.
pub const PACKET_MAX: usize = 32;
/// Maximum length of the payload \[B\].
pub const PAYLOAD_MAX: usize = PACKET_MAX - OVERHEAD;
/// Bytes counted by the length byte besides the payload: the instruction or error, and the
/// checksum.
pub const LENGTH_OVERHEAD: u8 = 2;
/// Maximum number of packets in a frame: the buffer of the bus controller, one for each leg.
pub const FRAME_MAX: usize = 4;

/// One byte of ten bits at 3.333 Mbit/s (dsPIC33F at 40 MIPS with a divider of 2: exactly 10/3
/// MHz).
pub const BYTE_TIME: SimDuration = SimDuration::from_micros(3);

/// Class or id of a broadcast, which is not answered. ASSUMED, as in Dynamixel 1.0.
pub const BROADCAST: u8 = 0xFE;
/// Class of the boards that drive the motors of a leg. ASSUMED.
pub const CLASS_MOTORDRIVER: u8 = 0x01;
/// Class of the board that distributes power. ASSUMED.
pub const CLASS_POWERBOARD: u8 = 0x02;
/// Class of the bus controller. ASSUMED.
pub const CLASS_CONTROLLER: u8 = 0x03;

/// Register: id of the device, 1 byte, non-volatile. ASSUMED.
pub const REGISTER_ID: u8 = 0x00;
/// Register: version of the device's hardware and firmware, 2 bytes, read-only. ASSUMED.
pub const REGISTER_DEVICE_VERSION: u8 = 0x01;
/// Register: version of the protocol, 2 bytes, read-only. ASSUMED.
pub const REGISTER_PROTOCOL_VERSION: u8 = 0x02;
/// First register specific to a device. ASSUMED.
pub const REGISTER_FIRST_OWN: u8 = 0x10;
/// Version of the protocol: the one with the low-latency instruction. ASSUMED.
pub const PROTOCOL_VERSION: u16 = 0x0200;

/// Instruction of a request: any byte. A device refuses instructions that it does not implement.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Instruction(pub u8);

impl Instruction {
    /// Tests the presence of a device. No payload in request and response. ASSUMED code.
    pub const PING: Self = Self(0x01);
    /// Reads a register: address in the request, value in the response, low byte first. ASSUMED
    /// code and layout.
    pub const GET: Self = Self(0x02);
    /// Writes a register: address and value, low byte first. ASSUMED code and layout.
    pub const SET: Self = Self(0x03);
    /// Saves the values of the non-volatile registers. No payload in request and response. ASSUMED
    /// code.
    pub const SAVE: Self = Self(0x04);
    /// Device-specific exchange, answered at once with a reply prepared beforehand. ASSUMED code.
    pub const LOW_LATENCY: Self = Self(0x10);
}

/// Result of an instruction, reported by a response.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ErrorCode(pub u8);

macro_rules! named {
    ($type:ident, $other:literal, $($name:ident => $text:literal),* $(,)?) => {
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match *self {
                    $(Self::$name => f.write_str($text),)*
                    Self(code) => write!(f, $other, code),
                }
            }
        }
        impl fmt::Debug for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }
    };
}

named!(Instruction, "instruction {:#04x}",
    PING => "ping", GET => "get", SET => "set", SAVE => "save", LOW_LATENCY => "low-latency");

impl ErrorCode {
    /// Success. ASSUMED, as are all error codes.
    pub const OK: Self = Self(0x00);
    /// The device does not implement the instruction.
    pub const UNKNOWN_INSTRUCTION: Self = Self(0x01);
    /// The device has no such register.
    pub const UNKNOWN_REGISTER: Self = Self(0x02);
    /// The length of the payload does not match the instruction.
    pub const BAD_LENGTH: Self = Self(0x03);
    /// The register cannot be written.
    pub const READ_ONLY: Self = Self(0x04);
    /// The register does not accept the value.
    pub const BAD_VALUE: Self = Self(0x05);
    /// The device has no low-latency reply yet.
    pub const NOT_READY: Self = Self(0x06);
    /// Bus controller: the checksum of the request or of the response is wrong.
    pub const CHECKSUM: Self = Self(0x10);
    /// Bus controller: the board did not answer.
    pub const TIMEOUT: Self = Self(0x11);
    /// Bus controller: the response is truncated.
    pub const TRUNCATED: Self = Self(0x12);
    /// Bus controller: the board transmitted beyond the limit without completing a response.
    pub const BABBLE: Self = Self(0x13);
    /// Bus controller: the received bytes are not a response of that board.
    pub const UNEXPECTED: Self = Self(0x14);
    /// Bus controller: the buffer was full and the request was dropped.
    pub const OVERFLOW: Self = Self(0x15);
}

named!(ErrorCode, "error {:#04x}",
    OK => "ok", UNKNOWN_INSTRUCTION => "unknown instruction", UNKNOWN_REGISTER => "unknown register",
    BAD_LENGTH => "bad length", READ_ONLY => "read-only", BAD_VALUE => "bad value",
    NOT_READY => "no reply ready yet", CHECKSUM => "wrong checksum",
    TIMEOUT => "silent", TRUNCATED => "truncated response", BABBLE => "response beyond the time limit",
    UNEXPECTED => "not a response of that board", OVERFLOW => "buffer of the bus controller is full");
