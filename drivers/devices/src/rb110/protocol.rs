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

use std::ops::RangeInclusive;

use twinrig_wire::{Fields, FrameError, FrameFormat, FrameMatch, FramedMessage, bits, crc16, mask};

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
/// Lengths of a request: 9 bytes, and 3 for each line.
const REQUEST_LENGTHS: RangeInclusive<u8> = 9..=9 + 3 * 16;
/// Lengths of an answer: 7 bytes, and 2 for each analog input.
const ANSWER_LENGTHS: RangeInclusive<u8> = 7..=7 + 2 * 8;

const FORMAT: FrameFormat = FrameFormat {
    length,
    checksum: |content| crc16(content).to_le_bytes(),
};

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

fn length(front: &[u8]) -> FrameMatch {
    let lengths = match front.first() {
        None => return FrameMatch::Missing(usize::from(*ANSWER_LENGTHS.start())),
        Some(&REQUEST) => REQUEST_LENGTHS,
        Some(&ANSWER) => ANSWER_LENGTHS,
        Some(_) => return FrameMatch::Garbage,
    };
    match front.get(1) {
        None => FrameMatch::Missing(usize::from(lengths.start() - 1)),
        Some(length) if lengths.contains(length) => FrameMatch::Frame(usize::from(*length)),
        Some(_) => FrameMatch::Garbage,
    }
}

/// Returns the fields after header and length of a frame in this direction.
fn fields(frame: &[u8], header: u8) -> Result<Fields<'_>, FrameError> {
    match FORMAT.content(frame)? {
        [first, _, fields @ ..] if *first == header => Ok(Fields::new(fields)),
        _ => Err(FrameError::WrongDirection),
    }
}

/// Reads a number of `W` bytes for each bit of `present`, to the end of the frame.
fn numbers<T: Copy, const N: usize, const W: usize>(
    mut fields: Fields<'_>,
    present: u16,
    number: fn([u8; W]) -> T,
) -> Result<[Option<T>; N], FrameError> {
    let mut numbers = [None; N];
    for (place, present) in numbers.iter_mut().zip(bits::<N>(present.into())) {
        if present {
            *place = Some(number(fields.array()?));
        }
    }
    fields.end()?;
    Ok(numbers)
}

impl FramedMessage for Request {
    fn match_frame(front: &[u8]) -> FrameMatch {
        FORMAT.match_frame(front)
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let mut fields = fields(frame, REQUEST)?;
        let [sequence, range] = fields.array()?;
        let lines = u16::from_le_bytes(fields.array()?);
        let [inputs] = fields.array()?;
        let ticks = |[low, middle, high]: [u8; 3]| u32::from_le_bytes([low, middle, high, 0]);
        let pulses = numbers(fields, lines, ticks)?;
        if range > 1 || pulses.iter().flatten().any(|&ticks| ticks > TICKS_MAX) {
            return Err(FrameError::Range);
        }
        Ok(Self {
            sequence,
            twice: range == 1,
            pulses,
            inputs: bits(inputs.into()),
        })
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        let lines = self.pulses.map(|pulse| pulse.is_some());
        let length = REQUEST_LENGTHS.start() + 3 * lines.map(u8::from).iter().sum::<u8>();
        let [low, high, ..] = mask(&lines).to_le_bytes();
        let [inputs, ..] = mask(&self.inputs).to_le_bytes();
        FORMAT.encode(bytes, |bytes| {
            bytes.extend([REQUEST, length, self.sequence, self.twice.into()]);
            bytes.extend([low, high, inputs]);
            for ticks in self.pulses.iter().flatten() {
                bytes.extend(&ticks.to_le_bytes()[..3]);
            }
        });
    }
}

impl FramedMessage for Answer {
    fn match_frame(front: &[u8]) -> FrameMatch {
        FORMAT.match_frame(front)
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let mut fields = fields(frame, ANSWER)?;
        let [sequence, status, inputs] = fields.array()?;
        let counts = numbers(fields, inputs.into(), u16::from_le_bytes)?;
        if status > 1 || counts.iter().flatten().any(|&count| count >= COUNTS) {
            return Err(FrameError::Range);
        }
        Ok(Self {
            sequence,
            replaced: status == 1,
            counts,
        })
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        let inputs = self.counts.map(|count| count.is_some());
        let length = ANSWER_LENGTHS.start() + 2 * inputs.map(u8::from).iter().sum::<u8>();
        let [inputs, ..] = mask(&inputs).to_le_bytes();
        FORMAT.encode(bytes, |bytes| {
            bytes.extend([ANSWER, length, self.sequence, self.replaced.into(), inputs]);
            for count in self.counts.iter().flatten() {
                bytes.extend(count.to_le_bytes());
            }
        });
    }
}
