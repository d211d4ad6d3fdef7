use crate::{FrameError, FrameMatch};

/// Format of frames whose first bytes determine the length and whose last two bytes are a checksum
/// of all bytes before them.
///
/// ```
/// use twinrig_wire::{FrameFormat, FrameMatch, crc16};
///
/// /// Length of the whole frame, content, checksum.
/// const FORMAT: FrameFormat = FrameFormat {
///     length: |front| match front.first() {
///         None => FrameMatch::Missing(3),
///         Some(&length @ 3..) => FrameMatch::Frame(usize::from(length)),
///         Some(_) => FrameMatch::Garbage,
///     },
///     checksum: |content| crc16(content).to_le_bytes(),
/// };
///
/// let mut bytes = Vec::new();
/// FORMAT.encode(&mut bytes, |bytes| bytes.extend([5, 1, 2]));
/// assert_eq!(FORMAT.match_frame(&bytes), FrameMatch::Frame(5));
/// assert_eq!(FORMAT.match_frame(&bytes[..4]), FrameMatch::Missing(1));
/// assert_eq!(FORMAT.content(&bytes), Ok(&[5, 1, 2][..]));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FrameFormat {
    /// Returns [`FrameMatch::Frame`] with the length of a frame that begins with these bytes, or,
    /// if they do not determine it, [`FrameMatch::Missing`] with the number of bytes missing of the
    /// shortest frame.
    pub length: fn(&[u8]) -> FrameMatch,
    /// Returns the checksum of the bytes before it, in the order of transmission.
    pub checksum: fn(&[u8]) -> [u8; 2],
}

impl FrameFormat {
    /// Matches a frame at the front of a stream, for a [`crate::Framer`].
    pub fn match_frame(&self, front: &[u8]) -> FrameMatch {
        let length = match (self.length)(front) {
            FrameMatch::Frame(length) => length,
            other => return other,
        };
        let Some(frame) = front.get(..length) else {
            return FrameMatch::Missing(length - front.len());
        };
        match frame.split_last_chunk() {
            Some((content, checksum)) if (self.checksum)(content) == *checksum => {
                FrameMatch::Frame(length)
            }
            _ => FrameMatch::Garbage,
        }
    }

    /// Returns the bytes before the checksum.
    ///
    /// # Errors
    /// [`FrameError::NotAFrame`] if `frame` is not exactly one frame.
    pub fn content<'f>(&self, frame: &'f [u8]) -> Result<&'f [u8], FrameError> {
        match (self.match_frame(frame), frame.split_last_chunk::<2>()) {
            (FrameMatch::Frame(length), Some((content, _))) if length == frame.len() => Ok(content),
            _ => Err(FrameError::NotAFrame),
        }
    }

    /// Appends the content that `write` appends, and its checksum.
    pub fn encode(&self, bytes: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
        let start = bytes.len();
        write(bytes);
        let checksum = (self.checksum)(&bytes[start..]);
        bytes.extend(checksum);
    }
}

/// CRC-16/IBM-3740 of `bytes`: polynomial 0x1021, initial value 0xFFFF.
///
/// ```
/// assert_eq!(twinrig_wire::crc16(b"123456789"), 0x29b1);
/// ```
pub fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xffff, |crc, &byte| {
        let [high, low] = crc.to_be_bytes();
        (u16::from(low) << 8) ^ CRC16[usize::from(high ^ byte)]
    })
}

/// Remainders of the single bytes.
const CRC16: [u16; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < table.len() {
        #[expect(clippy::cast_possible_truncation, reason = "below 256")]
        let mut crc = (byte as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            let carry = crc & 0x8000 != 0;
            crc <<= 1;
            if carry {
                crc ^= 0x1021;
            }
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
};

/// Sum of `bytes` modulo 2¹⁶.
pub fn sum16(bytes: &[u8]) -> u16 {
    let bytes = bytes.iter().map(|&byte| u16::from(byte));
    bytes.fold(0, u16::wrapping_add)
}
