use crate::FrameMatch;

/// Frames of a protocol as a fault sees them ([`crate::FrameChoice`]).
#[derive(Clone, Copy, Debug)]
pub struct FrameReader {
    /// Matches a frame at the front of a stream, as for a [`crate::Framer`].
    pub match_frame: fn(&[u8]) -> FrameMatch,
    /// Returns the code of a message of the host; of an answer any code that is not among `kinds`,
    /// or none.
    pub code: fn(&[u8]) -> Option<u8>,
    /// Names and codes of the kinds of messages of the host, as decoders name them.
    pub kinds: &'static [(&'static str, u8)],
}

impl FrameReader {
    /// Returns the code of a kind of message.
    pub fn code_of(&self, kind: &str) -> Option<u8> {
        let found = self.kinds.iter().find(|(name, _)| *name == kind);
        found.map(|(_, code)| *code)
    }

    /// Returns the code of a message of the host whose kind is known.
    pub(crate) fn message(&self, frame: &[u8]) -> Option<u8> {
        let code = (self.code)(frame)?;
        self.kinds.iter().any(|it| it.1 == code).then_some(code)
    }
}
