use serde::{Deserialize, Serialize};

/// Result of matching a frame at the front of a byte stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameMatch {
    /// A complete frame of this many bytes with a valid checksum.
    Frame(usize),
    /// A possible beginning of a frame; at least this many bytes are missing.
    Missing(usize),
    /// No frame begins here.
    Garbage,
}

/// Splits a byte stream, received in arbitrary pieces, into frames. Where no frame begins, it skips
/// one byte and matches again, so it resynchronises after garbage.
///
/// The protocol supplies one function that matches the front of the stream. The function is called
/// with any number of available bytes, including none, and returns [`FrameMatch::Frame`] only for
/// frames whose checksum it has verified.
///
/// ```
/// use twinrig_wire::{FrameMatch, Framer};
///
/// /// `R`, digits, end of line.
/// fn match_frame(front: &[u8]) -> FrameMatch {
///     match front {
///         [] => FrameMatch::Missing(3),
///         [b'R', rest @ ..] => match rest.iter().position(|byte| !byte.is_ascii_digit()) {
///             Some(end) if end > 0 && rest[end] == b'\n' => FrameMatch::Frame(end + 2),
///             None if rest.len() < 6 => FrameMatch::Missing(1),
///             _ => FrameMatch::Garbage,
///         },
///         _ => FrameMatch::Garbage,
///     }
/// }
///
/// let mut framer = Framer::new(match_frame);
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

/// Changing state of a [`Framer`], to be saved and restored.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FramerState {
    bytes: Vec<u8>,
    /// Number of bytes already processed.
    consumed: usize,
    skipped: u64,
}

impl Framer {
    /// A framer that finds frames by `match_frame`.
    pub fn new(match_frame: fn(&[u8]) -> FrameMatch) -> Self {
        Self {
            match_frame,
            state: FramerState::default(),
        }
    }

    /// Appends received bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.state.bytes.drain(..self.state.consumed);
        self.state.consumed = 0;
        self.state.bytes.extend_from_slice(bytes);
    }

    /// Returns the next frame; none until more bytes are pushed.
    pub fn next_frame(&mut self) -> Option<&[u8]> {
        let state = &mut self.state;
        while state.consumed < state.bytes.len() {
            let rest = &state.bytes[state.consumed..];
            match (self.match_frame)(rest) {
                FrameMatch::Frame(length) if (1..=rest.len()).contains(&length) => {
                    let frame = state.consumed..state.consumed + length;
                    state.consumed = frame.end;
                    return Some(&state.bytes[frame]);
                }
                FrameMatch::Missing(_) => return None,
                FrameMatch::Frame(_) | FrameMatch::Garbage => {
                    state.consumed += 1;
                    state.skipped += 1;
                }
            }
        }
        None
    }

    /// Returns the minimum number of bytes missing for the next frame; never zero.
    pub fn missing(&self) -> usize {
        match (self.match_frame)(&self.state.bytes[self.state.consumed..]) {
            FrameMatch::Missing(count) => count.max(1),
            FrameMatch::Frame(_) | FrameMatch::Garbage => 1,
        }
    }

    /// Number of bytes outside frames.
    pub fn skipped(&self) -> u64 {
        self.state.skipped
    }

    /// Number of bytes in no frame so far: those outside frames, and the beginning of the next one.
    pub fn unframed(&self) -> u64 {
        let beginning = self.state.bytes.len() - self.state.consumed;
        self.state.skipped + beginning as u64
    }

    /// Returns the state to be saved.
    pub fn state(&self) -> &FramerState {
        &self.state
    }

    /// Restores a saved state.
    pub fn set_state(&mut self, state: FramerState) {
        self.state = state;
        // A snapshot of another part must not make a later call panic.
        self.state.consumed = self.state.consumed.min(self.state.bytes.len());
    }
}
