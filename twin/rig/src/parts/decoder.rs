//! Decoders of buses: texts of the frames in recorded bytes, for readers.

use std::fmt::Debug;

use twinrig_wire::{FramedMessage, Framer};

/// Direction of the bytes of a trace, which have a decoder each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the driver to the boards: the trace `BUS/out`.
    ToBoards,
    /// From the boards to the driver: the trace `BUS/in`.
    ToDriver,
}

/// Takes the bytes of a trace, in pieces of any length, and returns the texts of the frames that
/// are complete with each piece.
pub type Decoder = Box<dyn FnMut(&[u8]) -> Vec<String>>;

/// Bytes that belong to no frame, behind the frames of a piece.
const SKIPPED: &str = "bytes of no frame";

/// Returns the decoder of a protocol with one frame for each message.
pub(crate) fn framed<M: FramedMessage + Debug>() -> Decoder {
    let mut framer = Framer::new(M::match_frame);
    let mut skipped = 0;
    Box::new(move |bytes| {
        framer.push(bytes);
        let mut texts = Vec::new();
        while let Some(frame) = framer.next_frame() {
            texts.push(match M::decode(frame) {
                Ok(message) => compact(&format!("{message:?}")),
                Err(error) => error.to_string(),
            });
        }
        if framer.skipped() > skipped {
            texts.push(format!("{} {SKIPPED}", framer.skipped() - skipped));
            skipped = framer.skipped();
        }
        texts
    })
}

/// Shortens the text of a message: runs of the same element are counted.
fn compact(text: &str) -> String {
    let mut parts: Vec<(&str, usize)> = Vec::new();
    for part in text.split(", ") {
        match parts.last_mut() {
            Some((last, count)) if *last == part => *count += 1,
            _ => parts.push((part, 1)),
        }
    }
    let parts = parts.into_iter().map(|(part, count)| match count {
        1 => part.to_owned(),
        _ => format!("{part} ×{count}"),
    });
    parts.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use twinrig_devices::rb110::protocol::{Answer, LINES, Request};

    use super::*;

    #[test]
    fn frames_in_pieces_are_decoded_and_other_bytes_counted() {
        let mut pulses = [None; LINES];
        pulses[9] = Some(76_000);
        let request = Request {
            sequence: 7,
            pulses,
            ..Request::default()
        };
        let frame = request.to_frame();
        let mut decode = framed::<Request>();
        assert!(decode(&frame[..5]).is_empty());
        let texts = decode(&frame[5..]);
        assert_eq!(texts.len(), 1);
        assert!(texts[0].starts_with("Request { sequence: 7, twice: false"));
        assert!(texts[0].contains("Some(76000), None ×5"), "{}", texts[0]);
        // The frame of an answer is whole, and of the wrong direction.
        assert_eq!(
            decode(&Answer::default().to_frame()),
            ["the frame is of the other direction"]
        );
        let mut damaged = frame.clone();
        damaged[4] ^= 1;
        let texts = decode(&[damaged, frame].concat());
        assert!(texts[0].starts_with("Request"), "{texts:?}");
        assert!(texts[1].ends_with(SKIPPED), "{texts:?}");
    }
}
