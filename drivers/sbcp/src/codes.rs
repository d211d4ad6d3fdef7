//! Bytes, lengths and codes: the one table of everything that is printed nowhere. The thesis (section 5.3.1.3,
//! figure 5.5) gives the order of the bytes and the rule of the checksum; what the bytes are is ASSUMED, and is replaced
//! here.

use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

/// First byte of every packet. ASSUMED.
pub const HEADER: u8 = 0xFF;
/// Bytes of a packet beside its payload: header, class, id, length, instruction or error, checksum.
pub const OVERHEAD: usize = 6;
/// Longest packet \[B\]: what the boards' buffers hold.
pub const PACKET_MAX: usize = 32;
/// Longest payload \[B\].
pub const PAYLOAD_MAX: usize = PACKET_MAX - OVERHEAD;
/// What the length byte counts beside the payload: the instruction or error, and the checksum.
pub const LENGTH_BESIDE: u8 = 2;
/// Most packets in a frame: what the bus controller buffers, and one for each leg.
pub const FRAME_MAX: usize = 4;

/// One byte of ten bits at 3.333 Mbit/s (dsPIC33F at 40 MIPS with a divider of 2: exactly 10/3 MHz).
pub const BYTE_TIME: SimDuration = SimDuration::from_micros(3);

/// Class or id that means every one; nobody answers. ASSUMED, as in Dynamixel 1.0.
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
/// First register that is a device's own. ASSUMED.
pub const REGISTER_FIRST_OWN: u8 = 0x10;
/// Version of the protocol: the one with the low-latency instruction. ASSUMED.
pub const PROTOCOL_VERSION: u16 = 0x0200;

/// What a request wants done. Any byte can be asked for; what a device does not know it refuses.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Instruction(pub u8);

impl Instruction {
    /// Are you there? No payload either way. ASSUMED code.
    pub const PING: Self = Self(0x01);
    /// Read a register: its address; comes back as its value, low byte first. ASSUMED code and layout.
    pub const GET: Self = Self(0x02);
    /// Write a register: its address and its value, low byte first. ASSUMED code and layout.
    pub const SET: Self = Self(0x03);
    /// Keep the non-volatile registers as they are now. No payload either way. ASSUMED code.
    pub const SAVE: Self = Self(0x04);
    /// The device's own exchange, answered at once from a reply made beforehand. ASSUMED code.
    pub const LOW_LATENCY: Self = Self(0x10);
}

/// What a response says about the instruction.
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
    /// Done. ASSUMED, as all of these.
    pub const OK: Self = Self(0x00);
    /// The device does not know the instruction.
    pub const UNKNOWN_INSTRUCTION: Self = Self(0x01);
    /// The device has no such register.
    pub const UNKNOWN_REGISTER: Self = Self(0x02);
    /// The payload has not the length that the instruction wants.
    pub const BAD_LENGTH: Self = Self(0x03);
    /// The register cannot be written.
    pub const READ_ONLY: Self = Self(0x04);
    /// The register does not take that value.
    pub const BAD_VALUE: Self = Self(0x05);
    /// The device has no low-latency reply yet.
    pub const NOT_READY: Self = Self(0x06);
    /// Bus controller: the packet's checksum is wrong, the request's or the response's.
    pub const CHECKSUM: Self = Self(0x10);
    /// Bus controller: the board kept silent.
    pub const TIMEOUT: Self = Self(0x11);
    /// Bus controller: the response broke off.
    pub const TRUNCATED: Self = Self(0x12);
    /// Bus controller: the board went on talking past the limit, without a response.
    pub const BABBLE: Self = Self(0x13);
    /// Bus controller: what was heard is no response of that board.
    pub const STRANGE: Self = Self(0x14);
    /// Bus controller: its buffer is full, the request was dropped.
    pub const OVERFLOW: Self = Self(0x15);
}

named!(ErrorCode, "error {:#04x}",
    OK => "ok", UNKNOWN_INSTRUCTION => "unknown instruction", UNKNOWN_REGISTER => "unknown register",
    BAD_LENGTH => "bad length", READ_ONLY => "read-only", BAD_VALUE => "bad value",
    NOT_READY => "no reply ready yet", CHECKSUM => "wrong checksum",
    TIMEOUT => "silent", TRUNCATED => "broke off", BABBLE => "talked too long",
    STRANGE => "no response of that board", OVERFLOW => "buffer of the bus controller full");
