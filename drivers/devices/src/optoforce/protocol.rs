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
use twinrig_wire::{Fields, FrameError, FrameFormat, FrameMatch, FramedMessage, sum16};

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

const FORMAT: FrameFormat = FrameFormat {
    length,
    checksum: |content| sum16(content).to_be_bytes(),
};

/// Returns the code that sets the present force as offset, or removes the offset.
const fn zero_code(zero: bool) -> u8 {
    if zero { 255 } else { 0 }
}

/// Output rate of a sensor. The code is the period in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Speed {
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

/// Cut-off frequency of a sensor's filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cutoff {
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

impl Speed {
    /// All speeds.
    pub const ALL: &[Self] = &[
        Self::Stop,
        Self::Hz1000,
        Self::Hz333,
        Self::Hz100,
        Self::Hz30,
        Self::Hz10,
    ];

    /// Returns the code in a configuration.
    pub const fn code(self) -> u8 {
        self as u8
    }
}

impl Cutoff {
    /// All frequencies.
    pub const ALL: &[Self] = &[
        Self::None,
        Self::Hz500,
        Self::Hz150,
        Self::Hz50,
        Self::Hz15,
        Self::Hz5,
        Self::Hz1p5,
    ];

    /// Returns the code in a configuration.
    pub const fn code(self) -> u8 {
        self as u8
    }

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

/// Message of computer or sensor.
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

fn length(front: &[u8]) -> FrameMatch {
    let matches = |header: &&[u8; 4]| header.iter().zip(front).all(|(a, b)| a == b);
    match HEADERS.iter().find(matches) {
        None => FrameMatch::Garbage,
        Some(header) if front.len() < header.len() => FrameMatch::Missing(SHORTEST - front.len()),
        Some([.., length]) => FrameMatch::Frame(usize::from(*length) + OVERHEAD),
    }
}

/// Returns the value whose code is `code`.
fn coded<T: Copy>(code: u8, all: &[T], code_of: fn(T) -> u8) -> Result<T, FrameError> {
    let found = all.iter().find(|&&value| code_of(value) == code);
    found.copied().ok_or(FrameError::Range)
}

impl FramedMessage for Message {
    fn match_frame(front: &[u8]) -> FrameMatch {
        FORMAT.match_frame(front)
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let mut fields = Fields::new(FORMAT.content(frame)?);
        let header = fields.array()?;
        match header {
            CONFIGURATION => {
                let [speed, cutoff, zero] = fields.array()?;
                Ok(Self::Configuration {
                    speed: coded(speed, Speed::ALL, Speed::code)?,
                    cutoff: coded(cutoff, Cutoff::ALL, Cutoff::code)?,
                    zero: coded(zero, &[true, false], zero_code)?,
                })
            }
            ACKNOWLEDGEMENT => {
                let [status] = fields.array()?;
                Ok(Self::Acknowledgement { status })
            }
            _ => Ok(Self::Data {
                counter: u16::from_be_bytes(fields.array()?),
                status: Status(u16::from_be_bytes(fields.array()?)),
                counts: match header {
                    DATA => Counts::Three(fields.numbers(i16::from_be_bytes)?),
                    DATA_SIX => Counts::Six(fields.numbers(i16::from_be_bytes)?),
                    _ => {
                        let mut sensors = [[0; 3]; 4];
                        for counts in &mut sensors {
                            *counts = fields.numbers(i16::from_be_bytes)?;
                        }
                        Counts::Four(sensors)
                    }
                },
            }),
        }
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        FORMAT.encode(bytes, |bytes| match self {
            Self::Data {
                counter,
                status,
                counts,
            } => {
                let (header, counts) = match counts {
                    Counts::Three(counts) => (DATA, &counts[..]),
                    Counts::Four(counts) => (DATA_FOUR, counts.as_flattened()),
                    Counts::Six(counts) => (DATA_SIX, &counts[..]),
                };
                bytes.extend(header);
                bytes.extend(counter.to_be_bytes());
                bytes.extend(status.0.to_be_bytes());
                bytes.extend(counts.iter().flat_map(|count| count.to_be_bytes()));
            }
            Self::Configuration {
                speed,
                cutoff,
                zero,
            } => {
                bytes.extend(CONFIGURATION);
                bytes.extend([speed.code(), cutoff.code(), zero_code(*zero)]);
            }
            Self::Acknowledgement { status } => {
                bytes.extend(ACKNOWLEDGEMENT);
                bytes.push(*status);
            }
        });
    }
}
