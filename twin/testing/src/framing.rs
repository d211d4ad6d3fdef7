//! Framing of a stream of bytes.

use twinrig_wire::{FrameMatch, Framer};

/// Frame matcher of a protocol.
pub type Matcher = fn(&[u8]) -> FrameMatch;

/// Returns the frames of a stream that is received in these pieces, and the number of bytes outside
/// frames.
pub fn frames(match_frame: Matcher, pieces: &[&[u8]]) -> (Vec<Vec<u8>>, u64) {
    let mut framer = Framer::new(match_frame);
    let mut frames = Vec::new();
    for piece in pieces {
        framer.push(piece);
        while let Some(frame) = framer.next_frame() {
            frames.push(frame.to_vec());
        }
    }
    (frames, framer.skipped())
}

/// Returns the frames of a stream, after checking that they do not depend on its division.
pub fn frames_in_any_pieces(
    match_frame: Matcher,
    bytes: &[u8],
    mut cuts: Vec<usize>,
) -> Vec<Vec<u8>> {
    for cut in &mut cuts {
        *cut = (*cut).min(bytes.len());
    }
    cuts.extend([0, bytes.len()]);
    cuts.sort_unstable();
    let pieces: Vec<&[u8]> = cuts.windows(2).map(|cut| &bytes[cut[0]..cut[1]]).collect();
    let found = frames(match_frame, &pieces);
    assert_eq!(found, frames(match_frame, &[bytes]));
    found.0
}
