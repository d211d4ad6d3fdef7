//! Example protocol, not of a real device: the host sends `R`; the range finder answers `R1234` and
//! an end of line, the distance in millimetres, in one to five digits.

use twinrig_wire::FrameMatch;

/// Request of the host, and first byte of an answer.
pub const REQUEST: u8 = b'R';
/// Maximum distance that an answer can encode \[mm\].
pub const MILLIMETRES_MAX: u32 = 99_999;

const DIGITS_MAX: usize = 5;
const SHORTEST: usize = "R1\n".len();

/// Matches an answer at the front of a stream.
pub fn match_frame(front: &[u8]) -> FrameMatch {
    let Some((&REQUEST, rest)) = front.split_first() else {
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

/// Returns the distance of an answer \[mm\]; `None` if the frame is not an answer.
pub fn decode(frame: &[u8]) -> Option<u32> {
    let digits = frame.strip_prefix(&[REQUEST])?.strip_suffix(b"\n")?;
    std::str::from_utf8(digits).ok()?.parse().ok()
}

/// Appends the answer for a distance \[mm\], saturated at the maximum.
pub fn encode(millimetres: u32, bytes: &mut Vec<u8>) {
    let millimetres = millimetres.min(MILLIMETRES_MAX);
    bytes.extend(format!("R{millimetres}\n").bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinrig_wire::Framer;

    #[test]
    fn answers_are_decoded_byte_by_byte_amid_garbage() {
        let mut bytes = b"12\nRR9x".to_vec();
        let distances = [0, 7, 1234, MILLIMETRES_MAX];
        for millimetres in distances {
            encode(millimetres, &mut bytes);
        }
        let mut framer = Framer::new(match_frame);
        let mut decoded = Vec::new();
        for byte in bytes {
            framer.push(&[byte]);
            while let Some(frame) = framer.next_frame() {
                decoded.extend(decode(frame));
            }
        }
        assert_eq!(decoded, distances);
        assert_eq!(framer.skipped(), 7);
    }

    #[test]
    fn missing_count_never_exceeds_the_frame() {
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
