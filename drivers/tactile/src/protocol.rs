//! Frames between computer and board. The cards of the bench have no serial protocol: everything
//! here is ASSUMED, for a board that speaks it. Numbers are little-endian; the checksum is
//! [`crc16`] of all bytes before it.
//!
//! | frame | bytes | |
//! |---|---|---|
//! | start | 6 | `B0`, period in µs (2), oversampling (1), checksum |
//! | stop | 3 | `B1`, checksum |
//! | zero | 3 | `B2`, checksum: the next sample of the reference cell becomes its zero |
//! | clock report | 16 | `B3`, boot (1), stamp (4), host time in ns (8), checksum |
//! | acknowledgement | 5 | `B8`, command (1: `B0` …), status (0: done, 1: rejected), checksum |
//! | data | 18 | `B9`, boot (1), sequence (2), stamp (4), 2 × volts (2), bridge (3), status, checksum |
//!
//! - *Boot* is incremented at every start of the firmware; sequence and stamp then begin at 0.
//! - *Stamp* is the board's time in µs, modulo 2³² (71.6 min), of the middle of the conversions of
//!   a sample.
//! - *Voltages* are signed, 32 768 counts for 10 V; the *bridge* has 2²³ counts for 25 mV/V.
//! - *Status:* bits 0 to 2: channel saturated (piezoresistive, piezoelectric, bridge); bit 3:
//!   samples before this one were dropped because the line was too slow; bit 4: the sample is a
//!   mean of several conversions (anti-aliasing); 5 to 7: 0.
//! - *Clock report:* the host's estimate of the time of a stamp. A board that does not need it
//!   ignores it.
//!
//! The checksum is a CRC because a sum does not detect exchanged bytes and misses half of the
//! errors of two bits in the same place of two bytes; this CRC detects every error of up to three
//! bits in a frame and every burst of up to 16.

use serde::{Deserialize, Serialize};
use twinrig_wire::{Fields, FrameError, FrameFormat, FrameMatch, FramedMessage, bits, crc16, mask};

/// Voltage of a card's full scale \[V\], exclusive, in either direction.
pub const VOLTS: f64 = 10.0;
/// Counts at [`VOLTS`]: 16 bits, 0.305 mV each.
pub const VOLTAGE_COUNTS: i32 = 1 << 15;
/// Output over supply at the bridge's full scale \[1\], exclusive, in either direction: 25 mV/V.
pub const RATIO: f64 = 25e-3;
/// Counts at [`RATIO`]: 24 bits.
pub const BRIDGE_COUNTS: i32 = 1 << 23;
/// Supported numbers of conversions per sample.
pub const OVERSAMPLING: [u8; 3] = [1, 2, 4];
/// Unit of the period \[µs\].
pub const PERIOD_STEP_US: u16 = 1000;

const START: u8 = 0xb0;
const STOP: u8 = 0xb1;
const ZERO: u8 = 0xb2;
const CLOCK: u8 = 0xb3;
const ACKNOWLEDGEMENT: u8 = 0xb8;
const DATA: u8 = 0xb9;
const SHORTEST: usize = 3;
/// Length of a data frame.
pub(crate) const DATA_LENGTH: usize = 18;

const FORMAT: FrameFormat = FrameFormat {
    length,
    checksum: |content| crc16(content).to_le_bytes(),
};

/// Command that a board acknowledges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// Start.
    Start,
    /// Stop.
    Stop,
    /// Zero of the reference cell.
    Zero,
    /// A frame with invalid content.
    Unknown,
}

/// Status of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// Channels out of range: piezoresistive, piezoelectric, bridge.
    pub saturated: [bool; 3],
    /// Samples before this one were dropped because the line was too slow.
    pub overrun: bool,
    /// The sample is a mean of several conversions.
    pub anti_aliased: bool,
}

/// Message of computer or board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// Starts the samples, or continues them, if they run with these settings.
    Start {
        /// Time between two samples \[µs\], a multiple of [`PERIOD_STEP_US`].
        period_us: u16,
        /// Conversions per sample: one of [`OVERSAMPLING`].
        oversampling: u8,
    },
    /// Stops the samples.
    Stop,
    /// Makes the next sample of the reference cell its zero.
    Zero,
    /// Time of a stamp by the clock of the host.
    Clock {
        /// Boot of the stamp.
        boot: u8,
        /// Stamp of a sample \[µs\].
        stamp: u32,
        /// Time of the host \[ns\].
        host_ns: u64,
    },
    /// Answer of a board to a command.
    Acknowledgement {
        /// The command.
        command: Command,
        /// Whether it was accepted.
        done: bool,
    },
    /// A sample.
    Data {
        /// Number of the boot.
        boot: u8,
        /// Number of the sample, incremented by one per sample, dropped ones included.
        sequence: u16,
        /// Board time of the sample \[µs\].
        stamp: u32,
        /// Voltages \[counts\].
        volts: [i16; 2],
        /// Bridge \[counts\], 24 bits.
        bridge: i32,
        /// Status.
        status: Status,
    },
}

impl Command {
    const ALL: [Self; 4] = [Self::Start, Self::Stop, Self::Zero, Self::Unknown];

    const fn code(self) -> u8 {
        match self {
            Self::Start => START,
            Self::Stop => STOP,
            Self::Zero => ZERO,
            Self::Unknown => 0,
        }
    }
}

impl Status {
    fn of_bits(status: u8) -> Result<Self, FrameError> {
        let [
            resistive,
            electric,
            bridge,
            overrun,
            anti_aliased,
            rest @ ..,
        ] = bits::<8>(status.into());
        if rest.contains(&true) {
            return Err(FrameError::Range);
        }
        Ok(Self {
            saturated: [resistive, electric, bridge],
            overrun,
            anti_aliased,
        })
    }

    fn bits(self) -> u8 {
        let [resistive, electric, bridge] = self.saturated;
        let [byte, ..] =
            mask(&[resistive, electric, bridge, self.overrun, self.anti_aliased]).to_le_bytes();
        byte
    }
}

fn length(front: &[u8]) -> FrameMatch {
    match front.first() {
        None => FrameMatch::Missing(SHORTEST),
        Some(&START) => FrameMatch::Frame(6),
        Some(&(STOP | ZERO)) => FrameMatch::Frame(SHORTEST),
        Some(&CLOCK) => FrameMatch::Frame(16),
        Some(&ACKNOWLEDGEMENT) => FrameMatch::Frame(5),
        Some(&DATA) => FrameMatch::Frame(DATA_LENGTH),
        Some(_) => FrameMatch::Garbage,
    }
}

fn start(fields: &mut Fields<'_>) -> Result<Message, FrameError> {
    let period_us = u16::from_le_bytes(fields.array()?);
    let [oversampling] = fields.array()?;
    let supported = period_us > 0
        && period_us.is_multiple_of(PERIOD_STEP_US)
        && OVERSAMPLING.contains(&oversampling);
    supported.then_some(()).ok_or(FrameError::Range)?;
    Ok(Message::Start {
        period_us,
        oversampling,
    })
}

fn acknowledgement(fields: &mut Fields<'_>) -> Result<Message, FrameError> {
    let [code, status] = fields.array()?;
    let mut all = Command::ALL.into_iter();
    let command = all.find(|command| command.code() == code);
    let done = match status {
        0 => Ok(true),
        1 => Ok(false),
        _ => Err(FrameError::Range),
    };
    Ok(Message::Acknowledgement {
        command: command.ok_or(FrameError::Range)?,
        done: done?,
    })
}

fn data(fields: &mut Fields<'_>) -> Result<Message, FrameError> {
    let [boot] = fields.array()?;
    let sequence = u16::from_le_bytes(fields.array()?);
    let stamp = u32::from_le_bytes(fields.array()?);
    let volts = fields.numbers(i16::from_le_bytes)?;
    let [low, middle, high] = fields.array()?;
    let [status] = fields.array()?;
    Ok(Message::Data {
        boot,
        sequence,
        stamp,
        volts,
        // The sign is in the highest byte.
        bridge: i32::from_le_bytes([0, low, middle, high]) >> 8,
        status: Status::of_bits(status)?,
    })
}

impl FramedMessage for Message {
    fn match_frame(front: &[u8]) -> FrameMatch {
        FORMAT.match_frame(front)
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let mut fields = Fields::new(FORMAT.content(frame)?);
        match fields.array()? {
            [START] => start(&mut fields),
            [STOP] => Ok(Self::Stop),
            [ZERO] => Ok(Self::Zero),
            [CLOCK] => {
                let [boot] = fields.array()?;
                let stamp = u32::from_le_bytes(fields.array()?);
                let host_ns = u64::from_le_bytes(fields.array()?);
                Ok(Self::Clock {
                    boot,
                    stamp,
                    host_ns,
                })
            }
            [ACKNOWLEDGEMENT] => acknowledgement(&mut fields),
            [_] => data(&mut fields),
        }
    }

    /// Appends the frame to `bytes`. The count of the bridge is truncated to 24 bits.
    fn encode(&self, bytes: &mut Vec<u8>) {
        FORMAT.encode(bytes, |bytes| match *self {
            Self::Start {
                period_us,
                oversampling,
            } => {
                bytes.push(START);
                bytes.extend(period_us.to_le_bytes());
                bytes.push(oversampling);
            }
            Self::Stop => bytes.push(STOP),
            Self::Zero => bytes.push(ZERO),
            Self::Clock {
                boot,
                stamp,
                host_ns,
            } => {
                bytes.extend([CLOCK, boot]);
                bytes.extend(stamp.to_le_bytes());
                bytes.extend(host_ns.to_le_bytes());
            }
            Self::Acknowledgement { command, done } => {
                bytes.extend([ACKNOWLEDGEMENT, command.code(), u8::from(!done)]);
            }
            Self::Data {
                boot,
                sequence,
                stamp,
                volts,
                bridge,
                status,
            } => {
                bytes.extend([DATA, boot]);
                bytes.extend(sequence.to_le_bytes());
                bytes.extend(stamp.to_le_bytes());
                bytes.extend(volts.map(i16::to_le_bytes).as_flattened());
                bytes.extend(&bridge.to_le_bytes()[..3]);
                bytes.push(status.bits());
            }
        });
    }
}
