//! Frames between computer and board. The real ones are not documented: everything here is ASSUMED.
//! Numbers are little-endian; the checksum is [`crc16`] of all bytes before it.
//!
//! | frame | bytes | |
//! |---|---|---|
//! | set-up, bridge | 7 | `F0 01`, data interval in ms (2), gain (1), checksum |
//! | set-up, interface kit | 7 | `F0 02`, change trigger (2), `00`, checksum |
//! | accepted | 4 | `F1`, status (0: done, 1: board of another type), checksum |
//! | report of a bridge | 17 | `F2`, sequence (1), overloads (1), 4 × counts (3), checksum |
//! | report of an interface kit | 20 | `F3`, sequence (1), 8 × reading (2, 0 to 1000), checksum |
//!
//! Overloads have one bit per channel; counts are signed.

use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_wire::{FrameMatch, crc16};

/// Channels of a bridge.
pub const BRIDGES: usize = 4;
/// Analog inputs of an interface kit.
pub const ANALOG: usize = 8;
/// Reading of an analog input at 5 V.
pub const SCALE: u16 = 1000;
/// Full scale of a bridge \[counts\], exclusive, in either direction: 24 bits.
pub const COUNTS: i32 = 1 << 23;
/// Maximum data interval \[ms\].
pub const INTERVAL_MS_MAX: u16 = 1000;

const SETUP: u8 = 0xf0;
const ACCEPTED: u8 = 0xf1;
const BRIDGE: u8 = 0xf2;
const INTERFACE_KIT: u8 = 0xf3;
const SHORTEST: usize = 4;

const SETUP_BRIDGE: u8 = 1;
const SETUP_INTERFACE_KIT: u8 = 2;

/// Gain of a bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Gain {
    /// Gain 1.
    #[default]
    X1,
    /// Gain 8.
    X8,
    /// Gain 16.
    X16,
    /// Gain 32.
    X32,
    /// Gain 64.
    X64,
    /// Gain 128.
    X128,
}

impl Gain {
    /// All gains in the order of their codes, which begin at 1.
    pub const ALL: [Self; 6] = [
        Self::X1,
        Self::X8,
        Self::X16,
        Self::X32,
        Self::X64,
        Self::X128,
    ];

    /// Returns the factor.
    pub const fn times(self) -> u8 {
        match self {
            Self::X1 => 1,
            Self::X8 => 8,
            Self::X16 => 16,
            Self::X32 => 32,
            Self::X64 => 64,
            Self::X128 => 128,
        }
    }

    /// Returns the gain with that factor.
    pub fn of_times(times: u64) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|gain| u64::from(gain.times()) == times)
    }

    fn code(self) -> u8 {
        self as u8 + 1
    }

    fn of_code(code: u8) -> Option<Self> {
        let index = usize::from(code).checked_sub(1)?;
        Self::ALL.get(index).copied()
    }
}

/// Set-up of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Setup {
    /// A bridge.
    Bridge {
        /// Data interval \[ms\].
        interval_ms: u16,
        /// Gain.
        gain: Gain,
    },
    /// An interface kit.
    InterfaceKit {
        /// Change of an input that triggers a report.
        trigger: u16,
    },
}

/// Bytes of a frame with correct header, length and checksum. Its content may be invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a>(&'a [u8]);

/// Valid content of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// Set-up, from computer to board.
    Setup(Setup),
    /// Answer of a board to a set-up.
    Accepted {
        /// Whether the set-up was accepted; if not, the board is of another type.
        done: bool,
    },
    /// Report of a bridge.
    Bridge {
        /// Sequence number, incremented by one per report.
        sequence: u8,
        /// Channels out of range.
        overload: [bool; BRIDGES],
        /// Ratio times gain, from −1 to 1 in 24 bits.
        counts: [i32; BRIDGES],
    },
    /// Report of an interface kit.
    InterfaceKit {
        /// Sequence number, incremented by one per report.
        sequence: u8,
        /// Readings, from 0 to [`SCALE`].
        readings: [u16; ANALOG],
    },
}

/// Reason why bytes are not a valid message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Header, length or checksum is wrong.
    #[error("not a frame: header, length or checksum is wrong")]
    NotAFrame,
    /// A number is out of range.
    #[error("a number in the frame is out of range")]
    Range,
}

const fn length(header: u8) -> Option<usize> {
    match header {
        SETUP => Some(7),
        ACCEPTED => Some(4),
        BRIDGE => Some(5 + 3 * BRIDGES),
        INTERFACE_KIT => Some(4 + 2 * ANALOG),
        _ => None,
    }
}

/// Matches a frame at the front of a stream, for a [`twinrig_wire::Framer`].
pub fn match_frame(front: &[u8]) -> FrameMatch {
    let Some(&header) = front.first() else {
        return FrameMatch::Missing(SHORTEST);
    };
    let Some(length) = length(header) else {
        return FrameMatch::Garbage;
    };
    let Some(frame) = front.get(..length) else {
        return FrameMatch::Missing(length - front.len());
    };
    let (content, checksum) = frame.split_at(length - 2);
    if crc16(content).to_le_bytes() == checksum {
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

    /// Returns the first byte, which identifies the kind of frame.
    pub fn header(&self) -> u8 {
        self.0[0]
    }

    /// Returns the bytes between header and checksum.
    pub fn body(&self) -> &'a [u8] {
        &self.0[1..self.0.len() - 2]
    }
}

impl TryFrom<Frame<'_>> for Message {
    type Error = FrameError;

    fn try_from(frame: Frame<'_>) -> Result<Self, FrameError> {
        match (frame.header(), frame.body()) {
            (SETUP, &[board, low, high, gain]) => {
                let number = u16::from_le_bytes([low, high]);
                setup(board, number, gain).map(Self::Setup)
            }
            (ACCEPTED, &[status @ 0..=1]) => Ok(Self::Accepted { done: status == 0 }),
            (BRIDGE, &[sequence, overload, ref counts @ ..]) if overload >> BRIDGES == 0 => {
                let mut counts = counts.chunks_exact(3);
                let mut next = || match counts.next() {
                    // The sign is in the highest byte.
                    Some(&[low, middle, high]) => i32::from_le_bytes([0, low, middle, high]) >> 8,
                    _ => 0,
                };
                Ok(Self::Bridge {
                    sequence,
                    overload: std::array::from_fn(|n| overload >> n & 1 == 1),
                    counts: std::array::from_fn(|_| next()),
                })
            }
            (INTERFACE_KIT, &[sequence, ref readings @ ..]) => {
                let mut words = readings.chunks_exact(2);
                let mut next = || match words.next() {
                    Some(&[low, high]) => u16::from_le_bytes([low, high]),
                    _ => 0,
                };
                let readings: [u16; ANALOG] = std::array::from_fn(|_| next());
                if readings.iter().any(|&reading| reading > SCALE) {
                    return Err(FrameError::Range);
                }
                Ok(Self::InterfaceKit { sequence, readings })
            }
            _ => Err(FrameError::Range),
        }
    }
}

fn setup(board: u8, number: u16, gain: u8) -> Result<Setup, FrameError> {
    match (board, Gain::of_code(gain)) {
        (SETUP_BRIDGE, Some(gain)) if (1..=INTERVAL_MS_MAX).contains(&number) => {
            Ok(Setup::Bridge {
                interval_ms: number,
                gain,
            })
        }
        (SETUP_INTERFACE_KIT, None) if gain == 0 && number <= SCALE => {
            Ok(Setup::InterfaceKit { trigger: number })
        }
        _ => Err(FrameError::Range),
    }
}

impl Message {
    /// Appends the frame to `bytes`. Counts of a bridge are truncated to 24 bits.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        match self {
            Self::Setup(Setup::Bridge { interval_ms, gain }) => {
                let [low, high] = interval_ms.to_le_bytes();
                bytes.extend([SETUP, SETUP_BRIDGE, low, high, gain.code()]);
            }
            Self::Setup(Setup::InterfaceKit { trigger }) => {
                let [low, high] = trigger.to_le_bytes();
                bytes.extend([SETUP, SETUP_INTERFACE_KIT, low, high, 0]);
            }
            Self::Accepted { done } => bytes.extend([ACCEPTED, u8::from(!done)]),
            Self::Bridge {
                sequence,
                overload,
                counts,
            } => {
                let over = overload.iter().enumerate().filter(|(_, over)| **over);
                bytes.extend([
                    BRIDGE,
                    *sequence,
                    over.fold(0, |bits, (n, _)| bits | 1 << n),
                ]);
                for count in counts {
                    bytes.extend(&count.to_le_bytes()[..3]);
                }
            }
            Self::InterfaceKit { sequence, readings } => {
                bytes.extend([INTERFACE_KIT, *sequence]);
                for reading in readings {
                    bytes.extend(reading.to_le_bytes());
                }
            }
        }
        let checksum = crc16(&bytes[start..]);
        bytes.extend(checksum.to_le_bytes());
    }
}
