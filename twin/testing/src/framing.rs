//! Framing of a stream of bytes: properties of the messages of a protocol.

use std::fmt::Debug;

use twinrig_wire::{FrameMatch, FramedMessage, Framer};

/// Returns the frames of a stream that is received in these pieces, and the number of bytes outside
/// frames.
pub fn frames<M: FramedMessage>(pieces: &[&[u8]]) -> (Vec<Vec<u8>>, u64) {
    let mut framer = Framer::new(M::match_frame);
    let mut frames = Vec::new();
    for piece in pieces {
        framer.push(piece);
        while let Some(frame) = framer.next_frame() {
            frames.push(frame.to_vec());
        }
    }
    (frames, framer.skipped())
}

/// Checks that the frames of a stream do not depend on its division into pieces, and that a message
/// decoded from one of them has the same frame.
pub fn check_arbitrary_bytes<M: FramedMessage>(bytes: &[u8], mut cuts: Vec<usize>) {
    for cut in &mut cuts {
        *cut = (*cut).min(bytes.len());
    }
    cuts.extend([0, bytes.len()]);
    cuts.sort_unstable();
    let pieces: Vec<&[u8]> = cuts.windows(2).map(|cut| &bytes[cut[0]..cut[1]]).collect();
    let found = frames::<M>(&pieces);
    assert_eq!(found, frames::<M>(&[bytes]));
    for frame in found.0 {
        if let Ok(message) = M::decode(&frame) {
            assert_eq!(message.to_frame(), frame);
        }
    }
}

/// Checks a message in a stream: its frame is decoded as the same message; no part of it is taken
/// for a frame, and the number of missing bytes is not too large; it is found after garbage.
pub fn check_message<M: FramedMessage + Debug + PartialEq>(message: &M, garbage: &[u8]) {
    let frame = message.to_frame();
    assert_eq!(M::decode(&frame).as_ref(), Ok(message));
    for kept in 0..frame.len() {
        let FrameMatch::Missing(count) = M::match_frame(&frame[..kept]) else {
            panic!("{kept} bytes of {frame:02x?}");
        };
        assert!(
            count >= 1 && kept + count <= frame.len(),
            "{kept} bytes of {frame:02x?}"
        );
    }
    // Enough bytes to complete a frame that seems to begin in the garbage.
    let bytes = [garbage, &frame.repeat(10)].concat();
    assert!(frames::<M>(&[&bytes]).0.contains(&frame));
}

/// Checks that the checksum detects a wrong bit in the frame of a message: the `n`-th, modulo the
/// number of bits.
pub fn check_wrong_bit<M: FramedMessage>(message: &M, n: usize) {
    let mut frame = message.to_frame();
    let bit = n % (8 * frame.len());
    frame[bit / 8] ^= 1 << (bit % 8);
    let undetected = FrameMatch::Frame(frame.len());
    assert_ne!(M::match_frame(&frame), undetected, "{frame:02x?}");
}
