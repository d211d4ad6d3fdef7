//! Instructions and errors.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Instruction of a packet: any byte. A servo refuses those that it does not implement.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Instruction(pub u8);

/// Error of an answer of protocol 2.0, without the alert bit.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ErrorNumber(pub u8);

macro_rules! named {
    ($type:ident, $other:literal, $($(#[$about:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        impl $type {
            $($(#[$about])* pub const $name: Self = Self($code);)*
        }
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

named! {
    Instruction, "instruction {:#04x}",
    /// Tests the presence of a servo; protocol 2.0 answers by model and firmware.
    PING = 0x01, "ping";
    /// Reads from the control table.
    READ = 0x02, "read";
    /// Writes to the control table.
    WRITE = 0x03, "write";
    /// Keeps a write until [`Instruction::ACTION`].
    REG_WRITE = 0x04, "reg write";
    /// Executes the kept write.
    ACTION = 0x05, "action";
    /// Sets the control table to its initial values.
    FACTORY_RESET = 0x06, "factory reset";
    /// Restarts the servo.
    REBOOT = 0x08, "reboot";
    /// Forgets turns or errors.
    CLEAR = 0x10, "clear";
    /// Answer of protocol 2.0.
    STATUS = 0x55, "status";
    /// Reads the same registers of several servos, which answer one after the other.
    SYNC_READ = 0x82, "sync read";
    /// Writes to the same registers of several servos.
    SYNC_WRITE = 0x83, "sync write";
    /// As [`Instruction::SYNC_READ`], with one answer of all.
    FAST_SYNC_READ = 0x8a, "fast sync read";
    /// Reads registers of each of several servos, which answer one after the other.
    BULK_READ = 0x92, "bulk read";
    /// Writes to registers of each of several servos.
    BULK_WRITE = 0x93, "bulk write";
    /// As [`Instruction::BULK_READ`], with one answer of all.
    FAST_BULK_READ = 0x9a, "fast bulk read";
}

named! {
    ErrorNumber, "error {:#04x}",
    /// Success.
    OK = 0x00, "ok";
    /// The instruction could not be processed.
    RESULT_FAIL = 0x01, "result fail";
    /// The instruction is not defined, or an action without a kept write.
    INSTRUCTION = 0x02, "instruction error";
    /// The checksum of the instruction is wrong.
    CRC = 0x03, "CRC error";
    /// A value is out of the range of its register.
    DATA_RANGE = 0x04, "data range error";
    /// The data are shorter than the register.
    DATA_LENGTH = 0x05, "data length error";
    /// A value is beyond a limit that another register sets.
    DATA_LIMIT = 0x06, "data limit error";
    /// The register does not exist, is read-only, or is locked while torque is on.
    ACCESS = 0x07, "access error";
}

impl ErrorNumber {
    /// Bit of an answer that reports a hardware error.
    pub const ALERT: u8 = 0x80;
}

/// Errors of answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Errors {
    /// Numbers of protocol 2.0, and the alert bit if there is a hardware error.
    Numbers,
    /// Bits of protocol 1.0, some of which are those of the hardware error.
    Bits,
    /// Bits of the hardware error alone.
    Hardware,
}

/// Errors that an answer reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ReportedErrors {
    /// A hardware error.
    pub(crate) hardware: bool,
    /// The instruction was refused.
    pub(crate) refused: bool,
}

impl Errors {
    /// Returns whether an error byte reports a hardware error, and whether it reports that the
    /// instruction was refused.
    pub(crate) fn of_byte(self, error: u8) -> ReportedErrors {
        const OF_INSTRUCTION: u8 = 0b0101_1010;
        match self {
            Self::Numbers => ReportedErrors {
                hardware: error & ErrorNumber::ALERT != 0,
                refused: error & !ErrorNumber::ALERT != 0,
            },
            Self::Bits => ReportedErrors {
                hardware: error & !OF_INSTRUCTION != 0,
                refused: error & OF_INSTRUCTION != 0,
            },
            Self::Hardware => ReportedErrors {
                hardware: error != 0,
                refused: false,
            },
        }
    }

    /// Returns the error byte of an answer.
    pub(crate) fn byte(self, error: ErrorNumber, hardware: u8) -> u8 {
        const ANGLE_LIMIT: u8 = 1 << 1;
        const RANGE: u8 = 1 << 3;
        const CHECKSUM: u8 = 1 << 4;
        const INSTRUCTION: u8 = 1 << 6;
        match self {
            Self::Numbers if hardware == 0 => error.0,
            Self::Numbers => error.0 | ErrorNumber::ALERT,
            Self::Hardware => hardware,
            Self::Bits => {
                hardware
                    | match error {
                        ErrorNumber::OK => 0,
                        ErrorNumber::CRC => CHECKSUM,
                        ErrorNumber::INSTRUCTION => INSTRUCTION,
                        ErrorNumber::DATA_LIMIT => ANGLE_LIMIT,
                        _ => RANGE,
                    }
            }
        }
    }
}
