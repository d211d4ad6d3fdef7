//! The frames between computer and board. How the real ones look is published nowhere: everything here is ASSUMED. A
//! computer asks, the board answers once. Numbers have their lowest byte first.
//!
//! | request | bytes | |
//! |---|---|---|
//! | header | 1 | `B1` |
//! | length | 1 | of the whole frame, 9 to 57 |
//! | sequence | 1 | comes back in the answer |
//! | range | 1 | 0: analog inputs reach to the reference, 1: to twice that |
//! | lines | 2 | one bit for each line that gets a new pulse |
//! | inputs | 1 | one bit for each analog input that is read |
//! | ticks | 3 each | of the lines, from the lowest on: 0 for no pulse, or its width in ticks of 20 ns |
//! | checksum | 2 | [`crc16`] of everything before |
//!
//! | answer | bytes | |
//! |---|---|---|
//! | header | 1 | `B2` |
//! | length | 1 | of the whole frame, 7 to 23 |
//! | sequence | 1 | of the request |
//! | status | 1 | bit 0: a pulse that was asked for before had not begun, and was replaced |
//! | inputs | 1 | as asked for |
//! | counts | 2 each | of the inputs, from the lowest on: 0 to 1023 |
//! | checksum | 2 | [`crc16`] of everything before |

use thiserror::Error;
use twinrig_wire::{FrameMatch, crc16};

/// Lines for pulses.
pub const LINES: usize = 16;
/// Analog inputs.
pub const ANALOG: usize = 8;
/// A tick of the pulses \[ns\]: 50 MHz.
pub const TICK_NS: u64 = 20;
/// The longest pulse: 10 ms.
pub const TICKS_MAX: u32 = 500_000;
/// The counts of the analog inputs end before that: 10 bits.
pub const COUNTS: u16 = 1024;

const REQUEST: u8 = 0xb1;
const ANSWER: u8 = 0xb2;
/// Header, length, sequence, range, lines, inputs; checksum.
const REQUEST_LEAST: usize = 9;
const REQUEST_MOST: usize = REQUEST_LEAST + 3 * LINES;
/// Header, length, sequence, status, inputs; checksum.
const ANSWER_LEAST: usize = 7;
const ANSWER_MOST: usize = ANSWER_LEAST + 2 * ANALOG;

/// What the computer asks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// Comes back in the answer.
    pub sequence: u8,
    /// Whether analog inputs reach to twice the reference.
    pub twice: bool,
    /// New pulses \[ticks\], of those lines that get one; 0: none from now on.
    pub pulses: [Option<u32>; LINES],
    /// Which analog inputs are read.
    pub inputs: [bool; ANALOG],
}

/// What the board answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Answer {
    /// Of the request.
    pub sequence: u8,
    /// Whether a pulse that was asked for before had not begun yet, and was replaced.
    pub replaced: bool,
    /// Counts of the analog inputs that were asked for.
    pub counts: [Option<u16>; ANALOG],
}

/// The bytes of a frame whose header, length and checksum are right. What is in it may still make no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a>(&'a [u8]);

/// A frame that says what cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Header, length or checksum are wrong.
    #[error("these bytes are no frame")]
    NoFrame,
    /// It is the other kind of frame.
    #[error("this is not the kind of frame that goes this way")]
    OtherWay,
    /// Its length is not what its bits say.
    #[error("the frame is not as long as what it says it holds")]
    Length,
    /// A number in it is out of range.
    #[error("a number in the frame is out of range")]
    Range,
}

impl<'a> Frame<'a> {
    /// The frame that `bytes` are.
    ///
    /// # Errors
    /// [`FrameError::NoFrame`] if they are none.
    pub fn new(bytes: &'a [u8]) -> Result<Self, FrameError> {
        match match_frame(bytes) {
            FrameMatch::Frame(length) if length == bytes.len() => Ok(Self(bytes)),
            _ => Err(FrameError::NoFrame),
        }
    }

    /// Whether it goes from computer to board.
    pub fn is_request(&self) -> bool {
        self.0[0] == REQUEST
    }

    /// Its sequence number.
    pub fn sequence(&self) -> u8 {
        self.0[2]
    }

    /// Everything between its sequence number and its checksum.
    pub fn body(&self) -> &'a [u8] {
        &self.0[3..self.0.len() - 2]
    }
}

/// What stands at the front of a stream, for a [`twinrig_wire::Framer`].
pub fn match_frame(front: &[u8]) -> FrameMatch {
    let Some(&header) = front.first() else {
        return FrameMatch::Missing(ANSWER_LEAST);
    };
    let lengths = match header {
        REQUEST => REQUEST_LEAST..=REQUEST_MOST,
        ANSWER => ANSWER_LEAST..=ANSWER_MOST,
        _ => return FrameMatch::Garbage,
    };
    let Some(&length) = front.get(1) else {
        return FrameMatch::Missing(lengths.start() - 1);
    };
    let length = usize::from(length);
    if !lengths.contains(&length) {
        return FrameMatch::Garbage;
    }
    let Some(frame) = front.get(..length) else {
        return FrameMatch::Missing(length - front.len());
    };
    let (tx, checksum) = frame.split_at(length - 2);
    if crc16(tx).to_le_bytes() == checksum {
        FrameMatch::Frame(length)
    } else {
        FrameMatch::Garbage
    }
}

impl Request {
    /// Appends the frame to `bytes`.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        let lines = mask(&self.pulses.map(|pulse| pulse.is_some()));
        let [low, high, ..] = lines.to_le_bytes();
        let inputs = mask(&self.inputs).to_le_bytes()[0];
        seal(bytes, REQUEST, |bytes| {
            bytes.extend([self.sequence, u8::from(self.twice), low, high, inputs]);
            for ticks in self.pulses.iter().flatten() {
                bytes.extend(&ticks.to_le_bytes()[..3]);
            }
        });
    }
}

impl Answer {
    /// Appends the frame to `bytes`.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        let inputs = mask(&self.counts.map(|count| count.is_some())).to_le_bytes()[0];
        seal(bytes, ANSWER, |bytes| {
            bytes.extend([self.sequence, u8::from(self.replaced), inputs]);
            for count in self.counts.iter().flatten() {
                bytes.extend(count.to_le_bytes());
            }
        });
    }
}

impl TryFrom<Frame<'_>> for Request {
    type Error = FrameError;

    fn try_from(frame: Frame<'_>) -> Result<Self, FrameError> {
        if !frame.is_request() {
            return Err(FrameError::OtherWay);
        }
        let &[range, low, high, inputs, ref ticks @ ..] = frame.body() else {
            return Err(FrameError::Length);
        };
        let lines: [bool; LINES] = bits(u32::from(u16::from_le_bytes([low, high])));
        let mut widths = ticks.chunks_exact(3);
        let mut pulses = [None; LINES];
        for (pulse, _) in pulses.iter_mut().zip(lines).filter(|(_, has)| *has) {
            let Some(&[low, middle, high]) = widths.next() else {
                return Err(FrameError::Length);
            };
            *pulse = Some(u32::from_le_bytes([low, middle, high, 0]));
        }
        if widths.next().is_some() || !widths.remainder().is_empty() {
            return Err(FrameError::Length);
        }
        if range > 1 || pulses.iter().flatten().any(|&ticks| ticks > TICKS_MAX) {
            return Err(FrameError::Range);
        }
        Ok(Self {
            sequence: frame.sequence(),
            twice: range == 1,
            pulses,
            inputs: bits(u32::from(inputs)),
        })
    }
}

impl TryFrom<Frame<'_>> for Answer {
    type Error = FrameError;

    fn try_from(frame: Frame<'_>) -> Result<Self, FrameError> {
        if frame.is_request() {
            return Err(FrameError::OtherWay);
        }
        let &[status, inputs, ref rest @ ..] = frame.body() else {
            return Err(FrameError::Length);
        };
        let asked: [bool; ANALOG] = bits(u32::from(inputs));
        let mut values = rest.chunks_exact(2);
        let mut counts = [None; ANALOG];
        for (count, _) in counts.iter_mut().zip(asked).filter(|(_, has)| *has) {
            let Some(&[low, high]) = values.next() else {
                return Err(FrameError::Length);
            };
            *count = Some(u16::from_le_bytes([low, high]));
        }
        if values.next().is_some() || !values.remainder().is_empty() {
            return Err(FrameError::Length);
        }
        if status > 1 || counts.iter().flatten().any(|&count| count >= COUNTS) {
            return Err(FrameError::Range);
        }
        Ok(Self {
            sequence: frame.sequence(),
            replaced: status == 1,
            counts,
        })
    }
}

/// Appends header, length, what `body` appends, and checksum.
fn seal(bytes: &mut Vec<u8>, header: u8, body: impl FnOnce(&mut Vec<u8>)) {
    let start = bytes.len();
    bytes.extend([header, 0]);
    body(bytes);
    let length = bytes.len() - start + 2;
    bytes[start + 1] = u8::try_from(length).expect("no frame of this module is as long as 255");
    let checksum = crc16(&bytes[start..]);
    bytes.extend(checksum.to_le_bytes());
}

fn mask(bits: &[bool]) -> u32 {
    let set = bits.iter().enumerate().filter(|(_, set)| **set);
    set.fold(0, |mask, (n, _)| mask | 1 << n)
}

fn bits<const N: usize>(mask: u32) -> [bool; N] {
    std::array::from_fn(|n| mask >> n & 1 == 1)
}
