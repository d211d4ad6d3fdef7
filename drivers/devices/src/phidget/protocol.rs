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
use twinrig_wire::{Fields, FrameError, FrameFormat, FrameMatch, FramedMessage, bits, crc16, mask};

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

const FORMAT: FrameFormat = FrameFormat {
    length,
    checksum: |content| crc16(content).to_le_bytes(),
};

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
        [1, 8, 16, 32, 64, 128][self as usize]
    }

    /// Returns the gain with that factor.
    pub fn of_times(times: u64) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|gain| u64::from(gain.times()) == times)
    }

    const fn code(self) -> u8 {
        self as u8 + 1
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

/// Message of computer or board.
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

fn length(front: &[u8]) -> FrameMatch {
    match front.first() {
        None => FrameMatch::Missing(SHORTEST),
        Some(&SETUP) => FrameMatch::Frame(7),
        Some(&ACCEPTED) => FrameMatch::Frame(4),
        Some(&BRIDGE) => FrameMatch::Frame(5 + 3 * BRIDGES),
        Some(&INTERFACE_KIT) => FrameMatch::Frame(4 + 2 * ANALOG),
        Some(_) => FrameMatch::Garbage,
    }
}

fn setup(board: u8, number: u16, gain: u8) -> Result<Setup, FrameError> {
    let code = |found: &Gain| found.code() == gain;
    match (board, Gain::ALL.into_iter().find(code)) {
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

impl FramedMessage for Message {
    fn match_frame(front: &[u8]) -> FrameMatch {
        FORMAT.match_frame(front)
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let mut fields = Fields::new(FORMAT.content(frame)?);
        match fields.array()? {
            [SETUP] => {
                let [board] = fields.array()?;
                let number = u16::from_le_bytes(fields.array()?);
                let [gain] = fields.array()?;
                setup(board, number, gain).map(Self::Setup)
            }
            [ACCEPTED] => match fields.array()? {
                [0] => Ok(Self::Accepted { done: true }),
                [1] => Ok(Self::Accepted { done: false }),
                _ => Err(FrameError::Range),
            },
            [BRIDGE] => {
                let [sequence, overload] = fields.array()?;
                if overload >> BRIDGES != 0 {
                    return Err(FrameError::Range);
                }
                // The sign is in the highest byte.
                let count =
                    |[low, middle, high]: [u8; 3]| i32::from_le_bytes([0, low, middle, high]) >> 8;
                Ok(Self::Bridge {
                    sequence,
                    overload: bits(overload.into()),
                    counts: fields.numbers(count)?,
                })
            }
            [_] => {
                let [sequence] = fields.array()?;
                let readings = fields.numbers(u16::from_le_bytes)?;
                if readings.iter().any(|&reading| reading > SCALE) {
                    return Err(FrameError::Range);
                }
                Ok(Self::InterfaceKit { sequence, readings })
            }
        }
    }

    /// Appends the frame to `bytes`. Counts of a bridge are truncated to 24 bits.
    fn encode(&self, bytes: &mut Vec<u8>) {
        FORMAT.encode(bytes, |bytes| match self {
            Self::Setup(Setup::Bridge { interval_ms, gain }) => {
                bytes.extend([SETUP, SETUP_BRIDGE]);
                bytes.extend(interval_ms.to_le_bytes());
                bytes.push(gain.code());
            }
            Self::Setup(Setup::InterfaceKit { trigger }) => {
                bytes.extend([SETUP, SETUP_INTERFACE_KIT]);
                bytes.extend(trigger.to_le_bytes());
                bytes.push(0);
            }
            Self::Accepted { done } => bytes.extend([ACCEPTED, u8::from(!done)]),
            Self::Bridge {
                sequence,
                overload,
                counts,
            } => {
                let [overload, ..] = mask(overload).to_le_bytes();
                bytes.extend([BRIDGE, *sequence, overload]);
                for count in counts {
                    bytes.extend(&count.to_le_bytes()[..3]);
                }
            }
            Self::InterfaceKit { sequence, readings } => {
                bytes.extend([INTERFACE_KIT, *sequence]);
                bytes.extend(readings.iter().flat_map(|reading| reading.to_le_bytes()));
            }
        });
    }
}
