//! The answer with a checksum, for `docs/tutorial-serial-device.md`: `R138*9C` and an end of line.

use twinrig::bus::{FrameError, FrameMatch, FramedMessage};

/// Answer of the range finder: a distance \[mm\].
#[derive(Debug, PartialEq, Eq)]
pub struct Answer(pub u32);

/// Sum of the digits' bytes modulo 256.
fn sum(digits: &[u8]) -> u8 {
    digits.iter().fold(0, |sum, digit| sum.wrapping_add(*digit))
}

const DIGITS_MAX: usize = 5;
/// Bytes besides the digits: `R`, `*`, two hexadecimal digits and the end of line.
const OTHERS: usize = 5;

impl FramedMessage for Answer {
    fn match_frame(front: &[u8]) -> FrameMatch {
        let [b'R', rest @ ..] = front else {
            return if front.is_empty() {
                FrameMatch::Missing(OTHERS + 1)
            } else {
                FrameMatch::Garbage
            };
        };
        let count = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let (digits, rest) = rest.split_at(count);
        if count > DIGITS_MAX {
            return FrameMatch::Garbage;
        }
        let end = format!("*{:02X}\n", sum(digits)).into_bytes();
        match end.strip_prefix(rest) {
            _ if rest.starts_with(&end) && count > 0 => FrameMatch::Frame(count + OTHERS),
            Some(_) if count == 0 && rest.is_empty() => FrameMatch::Missing(OTHERS),
            Some(missing) if count > 0 => FrameMatch::Missing(missing.len()),
            _ => FrameMatch::Garbage,
        }
    }

    fn decode(frame: &[u8]) -> Result<Self, FrameError> {
        let digits = frame.split(|byte| *byte == b'*').next();
        let digits = digits.and_then(|front| front.strip_prefix(b"R"));
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        let number = digits.and_then(|digits| digits.parse().ok());
        number.map(Self).ok_or(FrameError::Range)
    }

    fn encode(&self, bytes: &mut Vec<u8>) {
        let digits = self.0.to_string();
        let sum = sum(digits.as_bytes());
        bytes.extend(format!("R{digits}*{sum:02X}\n").bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use twinrig::testing::framing::{
        check_arbitrary_bytes, check_message, check_wrong_bit, frames,
    };

    proptest! {
        #[test]
        fn answer_is_decoded_amid_garbage(
            millimetres in 0..100_000_u32,
            garbage in vec(prop_oneof![Just(b'R'), b'0'..=b'9', b' '..=b'~'], 0..30),
        ) {
            check_message(&Answer(millimetres), &garbage);
        }

        #[test]
        fn arbitrary_bytes_in_arbitrary_pieces_do_not_panic(
            bytes in vec(prop_oneof![b'0'..=b'9', Just(b'R'), Just(b'*'), any::<u8>()], 0..100),
            cuts in vec(0..100_usize, 0..10),
        ) {
            check_arbitrary_bytes::<Answer>(&bytes, cuts);
        }

        #[test]
        fn wrong_bit_is_detected(millimetres in 0..100_000_u32, bit in any::<usize>()) {
            check_wrong_bit(&Answer(millimetres), bit);
        }

        #[test]
        fn lost_digit_is_detected(millimetres in 0..100_000_u32, n in 1..6_usize) {
            let mut frame = Answer(millimetres).to_frame();
            frame.remove(n.min(frame.len() - OTHERS));
            prop_assert_eq!(frames::<Answer>(&[&frame]).0.len(), 0);
        }
    }
}
