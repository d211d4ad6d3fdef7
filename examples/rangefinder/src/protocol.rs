//! An example protocol, of no real device: the host sends `R`, the range finder answers `R1234` and an end of line: the
//! distance in millimetres, in one to five digits.

use twinrig_wire::FrameMatch;

/// What the host sends.
pub const ASK: u8 = b'R';
/// The greatest distance that an answer can say \[mm\].
pub const MILLIMETRES_MAX: u32 = 99_999;

const DIGITS_MAX: usize = 5;
const SHORTEST: usize = "R1\n".len();

/// What stands at the front of a stream of answers.
pub fn match_frame(front: &[u8]) -> FrameMatch {
    let Some((&ASK, rest)) = front.split_first() else {
        return if front.is_empty() {
            FrameMatch::Missing(SHORTEST)
        } else {
            FrameMatch::Garbage
        };
    };
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    match rest.get(digits) {
        Some(b'\n') if (1..=DIGITS_MAX).contains(&digits) => FrameMatch::Frame(digits + 2),
        None if digits == 0 => FrameMatch::Missing(2),
        None if digits <= DIGITS_MAX => FrameMatch::Missing(1),
        _ => FrameMatch::Garbage,
    }
}

/// The distance that an answer says \[mm\]; none if it is no answer.
pub fn decode(frame: &[u8]) -> Option<u32> {
    let digits = frame.strip_prefix(&[ASK])?.strip_suffix(b"\n")?;
    std::str::from_utf8(digits).ok()?.parse().ok()
}

/// Appends the answer that says a distance \[mm\], or the greatest there is.
pub fn encode(millimetres: u32, bytes: &mut Vec<u8>) {
    let millimetres = millimetres.min(MILLIMETRES_MAX);
    bytes.extend(format!("R{millimetres}\n").bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinrig_wire::Framer;

    #[test]
    fn answers_come_back_one_byte_at_a_time_amid_garbage() {
        let mut bytes = b"12\nRR9x".to_vec();
        let tx = [0, 7, 1234, MILLIMETRES_MAX];
        for millimetres in tx {
            encode(millimetres, &mut bytes);
        }
        let mut framer = Framer::new(match_frame);
        let mut heard = Vec::new();
        for byte in bytes {
            framer.push(&[byte]);
            while let Some(frame) = framer.next_frame() {
                heard.extend(decode(frame));
            }
        }
        assert_eq!(heard, tx);
        assert_eq!(framer.skipped(), 7);
    }

    #[test]
    fn what_is_said_to_be_missing_is() {
        let mut bytes = Vec::new();
        encode(MILLIMETRES_MAX, &mut bytes);
        for kept in 0..bytes.len() {
            let FrameMatch::Missing(count) = match_frame(&bytes[..kept]) else {
                panic!("{kept} bytes");
            };
            assert!(count >= 1 && kept + count <= bytes.len());
        }
        assert_eq!(match_frame(b"R123456"), FrameMatch::Garbage);
        assert_eq!(match_frame(b"R\n"), FrameMatch::Garbage);
    }
}
