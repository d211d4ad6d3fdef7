//! The messages; replace them by those of your device. Here the host sends `R`; the device answers
//! `R1234` and an end of line, the distance in millimetres, in one to five digits.

use twinrig::bus::{FrameError, FrameMatch, FramedMessage};

/// Maximum distance that an answer can encode \[mm\].
pub const MILLIMETRES_MAX: u32 = 99_999;

const DIGITS_MAX: usize = 5;

/// Request of the host.
#[derive(Debug, PartialEq, Eq)]
pub struct Request;

/// Answer of the device: a distance \[mm\].
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
    use proptest::prelude::*;
    use twinrig::testing::framing::check_message;

    proptest! {
        /// Every answer is decoded as it was, found after garbage, and independent of the pieces in
        /// which its bytes arrive.
        #[test]
        fn answers_are_decoded_amid_garbage(millimetres in 0..=MILLIMETRES_MAX) {
            check_message(&Answer(millimetres), b"12\nRR9x");
        }

        /// Bytes from outside never panic.
        #[test]
        fn any_bytes_are_matched(bytes in proptest::collection::vec(any::<u8>(), 0..20)) {
            if let FrameMatch::Frame(length) = Answer::match_frame(&bytes) {
                prop_assert!(length <= bytes.len());
                let _ = Answer::decode(&bytes[..length]);
            }
        }
    }
}
