use serde::{Deserialize, Serialize};

/// What stands at the front of a stream of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameMatch {
    /// A whole frame of that many bytes, checksum and all.
    Frame(usize),
    /// What may become a frame, of which at least that many bytes are missing.
    Missing(usize),
    /// Nothing that begins a frame.
    Garbage,
}

/// Cuts a stream of bytes into frames, whatever pieces it comes in, and finds the next frame after garbage: where no frame
/// begins it leaves out one byte and looks again.
///
/// A protocol's own part is one function that judges the front of the stream. It sees what is there, from nothing at
/// all on, and says [`FrameMatch::Frame`] of checked frames only.
///
/// ```
/// use twinrig_wire::{Framer, Measure};
///
/// /// `R`, digits, end of line.
/// fn measure(front: &[u8]) -> Measure {
///     match front {
///         [] => Measure::Missing(3),
///         [b'R', rest @ ..] => match rest.iter().position(|byte| !byte.is_ascii_digit()) {
///             Some(end) if end > 0 && rest[end] == b'\n' => Measure::Frame(end + 2),
///             None if rest.len() < 6 => Measure::Missing(1),
///             _ => Measure::Garbage,
///         },
///         _ => Measure::Garbage,
///     }
/// }
///
/// let mut framer = Framer::new(measure);
/// framer.push(b"R12\xffR34");
/// assert_eq!(framer.next_frame(), None);
/// framer.push(b"\n");
/// assert_eq!(framer.next_frame(), Some(&b"R34\n"[..]));
/// assert_eq!(framer.skipped(), 4);
/// ```
#[derive(Clone, Debug)]
pub struct Framer {
    match_frame: fn(&[u8]) -> FrameMatch,
    state: FramerState,
}

/// What of a [`Framer`] changes: to be saved and restored.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FramerState {
    bytes: Vec<u8>,
    /// How many of them are done with.
    done: usize,
    skipped: u64,
}

impl Framer {
    /// Of a protocol's frames.
    pub fn new(match_frame: fn(&[u8]) -> FrameMatch) -> Self {
        Self {
            match_frame,
            state: FramerState::default(),
        }
    }

    /// Takes bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.state.bytes.drain(..self.state.done);
        self.state.done = 0;
        self.state.bytes.extend_from_slice(bytes);
    }

    /// The next frame; none until more bytes come.
    pub fn next_frame(&mut self) -> Option<&[u8]> {
        let state = &mut self.state;
        while state.done < state.bytes.len() {
            let rest = &state.bytes[state.done..];
            match (self.match_frame)(rest) {
                FrameMatch::Frame(length) if (1..=rest.len()).contains(&length) => {
                    let frame = state.done..state.done + length;
                    state.done = frame.end;
                    return Some(&state.bytes[frame]);
                }
                FrameMatch::Missing(_) => return None,
                FrameMatch::Frame(_) | FrameMatch::Garbage => {
                    state.done += 1;
                    state.skipped += 1;
                }
            }
        }
        None
    }

    /// How many bytes the next frame still wants, at least; never zero.
    pub fn missing(&self) -> usize {
        match (self.match_frame)(&self.state.bytes[self.state.done..]) {
            FrameMatch::Missing(count) => count.max(1),
            FrameMatch::Frame(_) | FrameMatch::Garbage => 1,
        }
    }

    /// Bytes that belonged to no frame.
    pub fn skipped(&self) -> u64 {
        self.state.skipped
    }

    /// What is to be saved.
    pub fn state(&self) -> &FramerState {
        &self.state
    }

    /// Goes back to a saved state.
    pub fn set_state(&mut self, state: FramerState) {
        self.state = state;
        // A snapshot of something else must not make a later call panic.
        self.state.done = self.state.done.min(self.state.bytes.len());
    }
}

/// The checksum CRC-16/IBM-3740 of `bytes`: polynomial 0x1021, from 0xFFFF on.
///
/// ```
/// assert_eq!(twinrig_wire::crc16(b"123456789"), 0x29b1);
/// ```
pub fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xffff, |crc, &byte| {
        (0..8).fold(crc ^ (u16::from(byte) << 8), |crc, _| {
            let shifted = crc << 1;
            if crc & 0x8000 == 0 {
                shifted
            } else {
                shifted ^ 0x1021
            }
        })
    })
}
