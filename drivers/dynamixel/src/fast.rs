//! The common answer to a fast read: its parts, each of a servo. Bytes are not stuffed (manual of
//! protocol 2.0, "Fast Sync Read").

use crc::Digest;

use crate::codes::Instruction;
use crate::protocol::{CRC, HEADER_2, ProtocolVersion, START_2, Status};

/// Appends the part of one servo to the common answer to a fast read: error, identifier, data, and
/// the CRC of all bytes of the packet up to there, of which those in `before` are of other servos.
/// The part of the first one begins with the header of an answer of all `servos` with so many bytes
/// of `data` together.
pub(crate) fn append_fast_part(
    first_of: Option<FastAnswer>,
    before: &[u8],
    status: &Status<'_>,
    bytes: &mut Vec<u8>,
) {
    let start = bytes.len();
    if let Some(answer) = first_of {
        bytes.extend(fast_header(answer.length()));
    }
    bytes.extend([status.error, status.id]);
    bytes.extend(status.data);
    let mut crc = CRC.digest();
    crc.update(before);
    crc.update(&bytes[start..]);
    bytes.extend(crc.finalize().to_le_bytes());
}

/// Returns header, identifier, length and code of a common answer of so many bytes.
fn fast_header(length: usize) -> [u8; START_2 + 1] {
    let counted = u16::try_from(length - START_2).unwrap_or(u16::MAX);
    let [low, high] = counted.to_le_bytes();
    let [a, b, c, d] = HEADER_2;
    let (all, status) = (ProtocolVersion::BROADCAST, Instruction::STATUS.0);
    [a, b, c, d, all, low, high, status]
}

/// Whether bytes may be the beginning of a common answer of `length` bytes.
pub(crate) fn is_beginning_of_fast_answer(bytes: &[u8], length: usize) -> bool {
    let header = fast_header(length);
    bytes
        .iter()
        .zip(&header)
        .all(|(byte, header)| byte == header)
}

/// Parts of the common answer to a fast read, each with the same number of bytes of data; none
/// where the checksum of a part is wrong.
pub(crate) struct FastParts<'p> {
    /// Parameters of the packet that are left.
    rest: &'p [u8],
    data: usize,
    crc: Digest<'static, u16>,
}

impl<'p> FastParts<'p> {
    /// Divides the parameters of a packet whose last checksum is verified and removed.
    pub(crate) fn new(parameters: &'p [u8], data: usize) -> Self {
        // The code and the last checksum.
        let length = START_2 + 1 + parameters.len() + 2;
        let mut crc = CRC.digest();
        crc.update(&fast_header(length));
        Self {
            rest: parameters,
            data,
            crc,
        }
    }
}

impl<'p> Iterator for FastParts<'p> {
    type Item = Option<Status<'p>>;

    fn next(&mut self) -> Option<Self::Item> {
        let (part, rest) = self.rest.split_at_checked(2 + self.data)?;
        let [error, id, data @ ..] = part else {
            return None;
        };
        self.crc.update(part);
        let mut is_intact = true;
        self.rest = rest;
        if let [low, high, behind @ ..] = rest {
            is_intact = self.crc.clone().finalize() == u16::from_le_bytes([*low, *high]);
            self.crc.update(&[*low, *high]);
            self.rest = behind;
        }
        let (error, id) = (*error, *id);
        Some(is_intact.then_some(Status { id, error, data }))
    }
}

/// Common answer to a fast read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FastAnswer {
    /// Number of servos.
    pub(crate) servos: usize,
    /// Number of bytes of their data.
    pub(crate) data: usize,
}

impl FastAnswer {
    /// Returns the number of bytes up to the part of a further servo: header, identifier, length
    /// and code, and error, identifier, data and CRC of each.
    pub(crate) const fn length(self) -> usize {
        START_2 + 1 + 4 * self.servos + self.data
    }
}
