//! Frames between computer and board. The real ones are not published: everything here is ASSUMED.
//! The computer sends a request, the board one answer. Numbers are little-endian.
//!
//! | request | bytes | |
//! |---|---|---|
//! | header | 1 | `B1` |
//! | length | 1 | of the whole frame, 9 to 57 |
//! | sequence | 1 | returned in the answer |
//! | range | 1 | full scale of the analog inputs; 0: the reference, 1: twice the reference |
//! | lines | 2 | one bit for each line with a new pulse |
//! | inputs | 1 | one bit for each analog input to be read |
//! | ticks | 3 each | of the lines, ascending: 0 for no pulse, or its width in ticks of 20 ns |
//! | checksum | 2 | [`crc16`] of all bytes before |
//!
//! | answer | bytes | |
//! |---|---|---|
//! | header | 1 | `B2` |
//! | length | 1 | of the whole frame, 7 to 23 |
//! | sequence | 1 | of the request |
//! | status | 1 | bit 0: a pulse requested before had not begun, and was replaced |
//! | inputs | 1 | as requested |
//! | counts | 2 each | of the inputs, ascending: 0 to 1023 |
//! | checksum | 2 | [`crc16`] of all bytes before |

use thiserror::Error;
use twinrig_wire::{FrameMatch, crc16};

/// Number of pulse lines.
pub const LINES: usize = 16;
/// Number of analog inputs.
pub const ANALOG: usize = 8;
/// Tick of the pulses \[ns\]: 50 MHz.
pub const TICK_NS: u64 = 20;
/// Longest pulse: 10 ms.
pub const TICKS_MAX: u32 = 500_000;
/// Number of counts of the analog inputs: 10 bits.
pub const COUNTS: u16 = 1024;

const REQUEST: u8 = 0xb1;
const ANSWER: u8 = 0xb2;
/// Header, length, sequence, range, lines, inputs; checksum.
const REQUEST_LEAST: usize = 9;
const REQUEST_MOST: usize = REQUEST_LEAST + 3 * LINES;
/// Header, length, sequence, status, inputs; checksum.
const ANSWER_LEAST: usize = 7;
const ANSWER_MOST: usize = ANSWER_LEAST + 2 * ANALOG;

/// Request of the computer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// Sequence number, returned in the answer.
    pub sequence: u8,
    /// Whether full scale of the analog inputs is twice the reference.
    pub twice: bool,
    /// New pulses \[ticks\] of the lines that get one; 0: no pulse from now on.
    pub pulses: [Option<u32>; LINES],
    /// Analog inputs to be read.
    pub inputs: [bool; ANALOG],
}

/// Answer of the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Answer {
    /// Sequence number of the request.
    pub sequence: u8,
    /// Whether a pulse requested before had not begun yet, and was replaced.
    pub replaced: bool,
    /// Counts of the requested analog inputs.
    pub counts: [Option<u16>; ANALOG],
}

/// Bytes of a frame with correct header, length and checksum. Its content may be invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a>(&'a [u8]);

/// Reason why bytes are not a valid message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Header, length or checksum is wrong.
    #[error("not a frame: header, length or checksum is wrong")]
    NotAFrame,
    /// The frame is of the other direction.
    #[error("the frame is of the other direction")]
    WrongDirection,
    /// The length does not match the bits of lines or inputs.
    #[error("the length of the frame does not match its content")]
    Length,
    /// A number is out of range.
    #[error("a number in the frame is out of range")]
    Range,
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

    /// Returns whether the frame is from the computer to the board.
    pub fn is_request(&self) -> bool {
        self.0[0] == REQUEST
    }

    /// Returns the sequence number.
    pub fn sequence(&self) -> u8 {
        self.0[2]
    }

    /// Returns the bytes between sequence number and checksum.
    pub fn body(&self) -> &'a [u8] {
        &self.0[3..self.0.len() - 2]
    }
}

/// Matches a frame at the front of a stream, for a [`twinrig_wire::Framer`].
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
    let (content, checksum) = frame.split_at(length - 2);
    if crc16(content).to_le_bytes() == checksum {
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
        encode_frame(bytes, REQUEST, |bytes| {
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
        encode_frame(bytes, ANSWER, |bytes| {
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
            return Err(FrameError::WrongDirection);
        }
        let &[range, low, high, inputs, ref ticks @ ..] = frame.body() else {
            return Err(FrameError::Length);
        };
        let lines: [bool; LINES] = bits(u32::from(u16::from_le_bytes([low, high])));
        let mut widths = ticks.chunks_exact(3);
        let mut pulses = [None; LINES];
        for (pulse, _) in pulses.iter_mut().zip(lines).filter(|(_, present)| *present) {
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
            return Err(FrameError::WrongDirection);
        }
        let &[status, inputs, ref rest @ ..] = frame.body() else {
            return Err(FrameError::Length);
        };
        let requested: [bool; ANALOG] = bits(u32::from(inputs));
        let mut values = rest.chunks_exact(2);
        let mut counts = [None; ANALOG];
        for (count, _) in counts
            .iter_mut()
            .zip(requested)
            .filter(|(_, present)| *present)
        {
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

/// Appends header, length, the bytes appended by `body`, and checksum.
fn encode_frame(bytes: &mut Vec<u8>, header: u8, body: impl FnOnce(&mut Vec<u8>)) {
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
