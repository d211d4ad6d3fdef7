use thiserror::Error;

use crate::FrameMatch;

/// Message of a protocol that travels as one frame.
pub trait FramedMessage: Sized {
    /// Matches a frame at the front of a stream; see [`crate::Framer`].
    fn match_frame(front: &[u8]) -> FrameMatch;

    /// Decodes a frame that [`FramedMessage::match_frame`] has found.
    ///
    /// # Errors
    /// [`FrameError`] if its content is invalid.
    fn decode(frame: &[u8]) -> Result<Self, FrameError>;

    /// Appends the frame to `bytes`.
    fn encode(&self, bytes: &mut Vec<u8>);

    /// Returns the frame.
    fn to_frame(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes);
        bytes
    }
}

/// Reason why bytes are not a valid message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Header, length or checksum is wrong.
    #[error("not a frame: header, length or checksum is wrong")]
    NotAFrame,
    /// The frame is of the other direction.
    #[error("the frame is of the other direction")]
    WrongDirection,
    /// The length does not match the content.
    #[error("the length of the frame does not match its content")]
    Length,
    /// A number is out of range, or a code is not defined.
    #[error("a number in the frame is out of range")]
    Range,
}
