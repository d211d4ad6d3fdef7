//! Payload of a cycle: set-points to the board, measurements to the host, all words little-endian
//! (order of the parts as in the thesis, table 5.3; ASSUMED beyond that).

use serde::{Deserialize, Serialize};

/// Length of a command \[B\].
pub const COMMAND_LEN: usize = 4;
/// Length of a reply \[B\].
pub const REPLY_LEN: usize = 16;

/// Measurements of a board \[counts\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Reply {
    /// Motors.
    pub(crate) positions: [u16; 2],
    /// Magnetic encoders L1 to L3.
    pub(crate) magnetic: [u16; 3],
    /// Force sensor.
    pub(crate) force: [u16; 3],
}

impl Reply {
    pub(crate) fn bytes(&self) -> [u8; REPLY_LEN] {
        let mut bytes = [0; REPLY_LEN];
        let words = self
            .positions
            .iter()
            .chain(&self.magnetic)
            .chain(&self.force);
        for (place, word) in bytes.chunks_exact_mut(2).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// Decodes a reply; `None` if its length is wrong.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; REPLY_LEN] = bytes.try_into().ok()?;
        let word = |n: usize| u16::from_le_bytes([bytes[2 * n], bytes[2 * n + 1]]);
        Some(Self {
            positions: [word(0), word(1)],
            magnetic: [word(2), word(3), word(4)],
            force: [word(5), word(6), word(7)],
        })
    }
}

/// Encodes set-points: positions \[counts\] or speeds.
pub(crate) fn command_bytes(goals: [u16; 2]) -> [u8; COMMAND_LEN] {
    let [[a, b], [c, d]] = goals.map(u16::to_le_bytes);
    [a, b, c, d]
}

/// Decodes the words of set-points. `None` if the length is wrong.
pub(crate) fn command(bytes: &[u8]) -> Option<[u16; 2]> {
    let &[a, b, c, d] = bytes else { return None };
    Some([[a, b], [c, d]].map(u16::from_le_bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_and_reply_round_trip() {
        assert_eq!(command(&command_bytes([1, 0x0FFE])), Some([1, 0x0FFE]));
        let reply = Reply {
            positions: [1, 2],
            magnetic: [3, 0xC004, 5],
            force: [6, 7, 0x0FFF],
        };
        assert_eq!(Reply::parse(&reply.bytes()), Some(reply));
        assert_eq!(&reply.bytes()[8..], [5, 0, 6, 0, 7, 0, 0xFF, 0x0F]);
    }

    #[test]
    fn wrong_lengths_are_rejected() {
        assert_eq!(command(&[0; 3]), None);
        assert_eq!(Reply::parse(&[0; 15]), None);
    }
}
