//! The messages, of a range finder that does not exist: replace them by those of your device. The
//! host sends `R`; the device answers `R1234` and an end of line, the distance in millimetres, in
//! one to five digits.

use twinrig::bus::{FrameError, FrameMatch, FramedMessage};

/// Maximum distance that an answer can encode \[mm\].
pub const MILLIMETRES_MAX: u32 = 99_999;

const DIGITS_MAX: usize = 5;

/// Request of the host.
#[derive(Debug, PartialEq, Eq)]
pub struct Request;

/// Answer of the range finder: a distance \[mm\].
#[derive(Debug, PartialEq, Eq)]
pub struct Answer(pub u32);

impl FramedMessage for Request {
    fn match_frame(front: &[u8]) -> FrameMatch {
        match front {
            [] => FrameMatch::Missing(1),
            [b'R', ..] => FrameMatch::Frame(1),
            _ => FrameMatch::Garbage,
        }
    }

    fn decode(_frame: &[u8]) -> Result<Self, FrameError> {
        Ok(Self)
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        bytes.push(b'R');
    }
}

impl FramedMessage for Answer {
    fn match_frame(front: &[u8]) -> FrameMatch {
        let rest = match front {
            [] => return FrameMatch::Missing("R1\n".len()),
            [b'R', rest @ ..] => rest,
            _ => return FrameMatch::Garbage,
        };
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        match rest.get(digits) {
            Some(b'\n') if (1..=DIGITS_MAX).contains(&digits) => FrameMatch::Frame(digits + 2),
            None if digits == 0 => FrameMatch::Missing(2),
            None if digits <= DIGITS_MAX => FrameMatch::Missing(1),
            _ => FrameMatch::Garbage,
        }
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let text = std::str::from_utf8(frame).unwrap_or_default();
        let digits = text.trim_matches(|c: char| !c.is_ascii_digit());
        digits.parse().map(Self).map_err(|_| FrameError::Range)
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        bytes.extend(format!("R{}\n", self.0).bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use twinrig::testing::framing::{check_message, frames};

    proptest! {
        /// Every answer is decoded as it was, found after garbage, and independent of the pieces in
        /// which its bytes arrive.
        #[test]
        fn answer_is_decoded_amid_garbage(
            millimetres in 0..=MILLIMETRES_MAX,
            // No end of line, which might complete an answer.
            garbage in vec(prop_oneof![Just(b'R'), b'0'..=b'9', b' '..=b'~'], 0..30),
        ) {
            check_message(&Answer(millimetres), &garbage);
        }

        /// Bytes from outside never panic, and the pieces in which they arrive have no influence.
        #[test]
        fn arbitrary_bytes_are_matched_in_any_pieces(
            bytes in vec(prop_oneof![b'0'..=b'9', Just(b'R'), Just(b'\n'), any::<u8>()], 0..100),
            cut in 0..100_usize,
        ) {
            let (front, back) = bytes.split_at(cut.min(bytes.len()));
            let found = frames::<Answer>(&[&bytes]);
            prop_assert_eq!(&found, &frames::<Answer>(&[front, back]));
            for frame in found.0 {
                prop_assert!(Answer::decode(&frame).is_ok_and(|it| it.0 <= MILLIMETRES_MAX));
            }
        }
    }

    #[test]
    fn answers_have_one_to_five_digits() {
        let received = frames::<Answer>(&[b"12\nRR9xR", b"7", b"\n"]);
        assert_eq!(received, (vec![b"R7\n".to_vec()], 7));
        assert_eq!(Answer::match_frame(b"R123456"), FrameMatch::Garbage);
        assert_eq!(Answer::match_frame(b"R\n"), FrameMatch::Garbage);
    }

    #[test]
    fn request_is_decoded_amid_garbage() {
        check_message(&Request, b"x1");
    }
}
