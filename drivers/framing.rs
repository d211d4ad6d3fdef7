//! What the tests of the protocols ask of a stream of bytes. Each crate's tests include this file.

use twinrig_wire::{FrameMatch, Framer};

/// How a protocol judges the front of a stream.
pub type Judge = fn(&[u8]) -> FrameMatch;

/// The frames of a stream that comes in these pieces, and how many bytes belong to none.
pub fn frames(match_frame: Judge, pieces: &[&[u8]]) -> (Vec<Vec<u8>>, u64) {
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

/// The frames of a stream, which are the same wherever it is cut.
pub fn frames_in_any_pieces(
    match_frame: Judge,
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
