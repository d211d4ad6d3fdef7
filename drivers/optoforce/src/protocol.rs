//! Frames between computer and sensor, version 1.7. Numbers are big-endian; the checksum is the sum
//! of all bytes before it, modulo 2¹⁶.
//!
//! | frame | bytes | |
//! |---|---|---|
//! | data | 16 | `AA 07 08 0A`, counter, status, 3 forces, checksum |
//! | data, four sensors | 34 | `AA 07 08 1C`, counter, status, 4 × 3 forces, checksum |
//! | data, six axes | 22 | `AA 07 08 10`, counter, status, 3 forces and 3 torques, checksum |
//! | configuration | 9 | `AA 00 32 03`, speed, filter, zero (255: zero, 0: undo), checksum |
//! | acknowledgement | 7 | `AA 00 50 01`, status (0: done), checksum |

use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_wire::FrameMatch;

const DATA: [u8; 4] = [0xaa, 7, 8, 10];
const DATA_FOUR: [u8; 4] = [0xaa, 7, 8, 28];
const DATA_SIX: [u8; 4] = [0xaa, 7, 8, 16];
const CONFIGURATION: [u8; 4] = [0xaa, 0, 50, 3];
const ACKNOWLEDGEMENT: [u8; 4] = [0xaa, 0, 80, 1];
/// Headers. The last byte is the number of bytes between header and checksum.
const HEADERS: [[u8; 4]; 5] = [DATA, DATA_FOUR, DATA_SIX, CONFIGURATION, ACKNOWLEDGEMENT];
/// Length of header and checksum.
const OVERHEAD: usize = 6;
const SHORTEST: usize = OVERHEAD + 1;

/// Sets the present force as offset.
const ZERO: u8 = 255;
/// Removes the offset.
const UNDO: u8 = 0;

macro_rules! coded {
    ($(#[$doc:meta])* $name:ident { $($(#[$of:meta])* $variant:ident = $code:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
        pub enum $name {
            $($(#[$of])* $variant,)*
        }

        impl $name {
            /// All values.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Returns the code in a configuration.
            pub const fn code(self) -> u8 {
                match self {
                    $(Self::$variant => $code,)*
                }
            }

            /// Returns the value with a code.
            pub const fn of_code(code: u8) -> Option<Self> {
                match code {
                    $($code => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }
    };
}

coded! {
    /// Output rate of a sensor. The code is the period in milliseconds.
    Speed {
        /// No output.
        Stop = 0,
        /// 1000 Hz.
        Hz1000 = 1,
        /// 333 Hz.
        Hz333 = 3,
        /// 100 Hz.
        #[default]
        Hz100 = 10,
        /// 30 Hz.
        Hz30 = 33,
        /// 10 Hz.
        Hz10 = 100,
    }
}

coded! {
    /// Cut-off frequency of a sensor's filter.
    Cutoff {
        /// No filter.
        None = 0,
        /// 500 Hz.
        Hz500 = 1,
        /// 150 Hz.
        Hz150 = 2,
        /// 50 Hz.
        Hz50 = 3,
        /// 15 Hz.
        #[default]
        Hz15 = 4,
        /// 5 Hz.
        Hz5 = 5,
        /// 1.5 Hz.
        Hz1p5 = 6,
    }
}

impl Cutoff {
    /// Returns the frequency \[Hz\].
    pub const fn hertz(self) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Hz500 => Some(500.0),
            Self::Hz150 => Some(150.0),
            Self::Hz50 => Some(50.0),
            Self::Hz15 => Some(15.0),
            Self::Hz5 => Some(5.0),
            Self::Hz1p5 => Some(1.5),
        }
    }
}

/// Status word of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status(pub u16);

/// State of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// No fault.
    Good,
    /// No sensor connected.
    Absent,
    /// Sensor failure.
    Failed,
    /// Temperature out of range.
    Temperature,
    /// A value that the protocol does not define.
    Other(u8),
}

impl Status {
    /// Returns the state of the electronics; 0 for no fault.
    pub const fn electronics(self) -> u8 {
        (self.0 >> 13) as u8
    }

    /// Returns the state of the sensor.
    pub const fn health(self) -> Health {
        match (self.0 >> 10 & 7) as u8 {
            0 => Health::Good,
            1 => Health::Absent,
            2 => Health::Failed,
            4 => Health::Temperature,
            other => Health::Other(other),
        }
    }

    /// Returns the overloaded axes, the first at the highest bit: x, y, z, and the torques about
    /// them.
    pub fn overload(self) -> [bool; 6] {
        std::array::from_fn(|axis| self.0 >> (9 - axis) & 1 == 1)
    }

    /// Returns the status with exactly these force axes overloaded.
    #[must_use]
    pub fn with_overload(self, axes: [bool; 3]) -> Self {
        let set = axes.iter().enumerate().filter(|(_, over)| **over);
        Self(set.fold(self.0 & !0x03f0, |bits, (axis, _)| bits | 1 << (9 - axis)))
    }

    /// Returns whether the sensor is one of several on the same electronics.
    pub const fn several(self) -> bool {
        self.0 >> 3 & 1 == 1
    }

    /// Returns its number among them.
    pub const fn number(self) -> u8 {
        (self.0 & 7) as u8
    }
}

/// Measured values \[counts\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counts {
    /// Force of one sensor.
    Three([i16; 3]),
    /// Forces of four sensors.
    Four([[i16; 3]; 4]),
    /// Force, then torque, of one sensor.
    Six([i16; 6]),
}

/// Bytes of a frame with correct header and checksum. Its content may be invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a>(&'a [u8]);

/// Valid content of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// A sample.
    Data {
        /// Number of the sample, incremented by one per sample.
        counter: u16,
        /// Status word.
        status: Status,
        /// Measured values.
        counts: Counts,
    },
    /// Configuration of a sensor.
    Configuration {
        /// Output rate.
        speed: Speed,
        /// Cut-off frequency of the filter.
        cutoff: Cutoff,
        /// Whether the present force becomes the offset; otherwise the factory offset is restored.
        zero: bool,
    },
    /// Answer of a sensor to a configuration.
    Acknowledgement {
        /// 0 if the configuration was accepted.
        status: u8,
    },
}

/// Reason why bytes are not a valid message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Header, length or checksum is wrong.
    #[error("not a frame: header, length or checksum is wrong")]
    NotAFrame,
    /// Undefined code of speed, filter or zero.
    #[error("{what} {code} is not defined")]
    Code {
        /// Name of the field.
        what: &'static str,
        /// Its value.
        code: u8,
    },
}

fn sum(bytes: &[u8]) -> u16 {
    let bytes = bytes.iter().map(|&byte| u16::from(byte));
    bytes.fold(0, u16::wrapping_add)
}

/// Matches a frame at the front of a stream, for a [`twinrig_wire::Framer`].
pub fn match_frame(front: &[u8]) -> FrameMatch {
    let matches = |header: &&[u8; 4]| header.iter().zip(front).all(|(a, b)| a == b);
    let Some(header) = HEADERS.iter().find(matches) else {
        return FrameMatch::Garbage;
    };
    if front.len() < header.len() {
        return FrameMatch::Missing(SHORTEST - front.len());
    }
    let length = usize::from(header[3]) + OVERHEAD;
    let Some(frame) = front.get(..length) else {
        return FrameMatch::Missing(length - front.len());
    };
    let (content, checksum) = frame.split_at(length - 2);
    if sum(content).to_be_bytes() == checksum {
        FrameMatch::Frame(length)
    } else {
        FrameMatch::Garbage
    }
}

impl<'a> Frame<'a> {
    /// Checks that `bytes` are exactly one frame.
    ///
    /// # Errors
    /// [`FrameError::NotAFrame`] if they are not.
    pub fn new(bytes: &'a [u8]) -> Result<Self, FrameError> {
        match match_frame(bytes) {
            FrameMatch::Frame(length) if length == bytes.len() => Ok(Self(bytes)),
            _ => Err(FrameError::NotAFrame),
        }
    }

    /// Returns the first four bytes, which identify the kind of frame.
    pub fn header(&self) -> &'a [u8] {
        &self.0[..4]
    }

    /// Returns the bytes between header and checksum.
    pub fn body(&self) -> &'a [u8] {
        &self.0[4..self.0.len() - 2]
    }

    /// Returns word `index` of the body; 0 past its end.
    fn word(&self, index: usize) -> u16 {
        let bytes = self.body().get(2 * index..2 * index + 2);
        bytes.map_or(0, |bytes| u16::from_be_bytes([bytes[0], bytes[1]]))
    }

    fn force(&self, index: usize) -> i16 {
        self.word(2 + index).cast_signed()
    }
}

impl TryFrom<Frame<'_>> for Message {
    type Error = FrameError;

    fn try_from(frame: Frame<'_>) -> Result<Self, FrameError> {
        use std::array::from_fn;

        let data = |counts| Self::Data {
            counter: frame.word(0),
            status: Status(frame.word(1)),
            counts,
        };
        Ok(match (frame.header(), frame.body()) {
            (header, &[speed, cutoff, zero]) if header == CONFIGURATION => Self::Configuration {
                speed: Speed::of_code(speed).ok_or(undefined("speed", speed))?,
                cutoff: Cutoff::of_code(cutoff).ok_or(undefined("filter", cutoff))?,
                zero: match zero {
                    ZERO => true,
                    UNDO => false,
                    other => return Err(undefined("zero", other)),
                },
            },
            (header, &[status]) if header == ACKNOWLEDGEMENT => Self::Acknowledgement { status },
            (header, _) if header == DATA => data(Counts::Three(from_fn(|n| frame.force(n)))),
            (header, _) if header == DATA_FOUR => data(Counts::Four(from_fn(|sensor| {
                from_fn(|n| frame.force(3 * sensor + n))
            }))),
            (header, _) if header == DATA_SIX => data(Counts::Six(from_fn(|n| frame.force(n)))),
            _ => return Err(FrameError::NotAFrame),
        })
    }
}

fn undefined(what: &'static str, code: u8) -> FrameError {
    FrameError::Code { what, code }
}

impl Message {
    /// Appends the frame to `bytes`.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        match self {
            Self::Data {
                counter,
                status,
                counts,
            } => {
                let (header, forces) = match counts {
                    Counts::Three(forces) => (DATA, &forces[..]),
                    Counts::Four(forces) => (DATA_FOUR, forces.as_flattened()),
                    Counts::Six(forces) => (DATA_SIX, &forces[..]),
                };
                bytes.extend(header);
                bytes.extend(counter.to_be_bytes());
                bytes.extend(status.0.to_be_bytes());
                for force in forces {
                    bytes.extend(force.to_be_bytes());
                }
            }
            Self::Configuration {
                speed,
                cutoff,
                zero,
            } => {
                bytes.extend(CONFIGURATION);
                let zero = if *zero { ZERO } else { UNDO };
                bytes.extend([speed.code(), cutoff.code(), zero]);
            }
            Self::Acknowledgement { status } => {
                bytes.extend(ACKNOWLEDGEMENT);
                bytes.push(*status);
            }
        }
        let checksum = sum(&bytes[start..]);
        bytes.extend(checksum.to_be_bytes());
    }
}
