//! Packets as faults see them.

use twinrig_wire::FrameReader;

use crate::codes::Instruction;
use crate::protocol::ProtocolVersion;

/// Instructions that a host sends, by the names that decoders give them.
const KINDS: &[(&str, u8)] = &[
    ("ping", Instruction::PING.0),
    ("read", Instruction::READ.0),
    ("write", Instruction::WRITE.0),
    ("reg write", Instruction::REG_WRITE.0),
    ("action", Instruction::ACTION.0),
    ("factory reset", Instruction::FACTORY_RESET.0),
    ("reboot", Instruction::REBOOT.0),
    ("clear", Instruction::CLEAR.0),
    ("sync read", Instruction::SYNC_READ.0),
    ("sync write", Instruction::SYNC_WRITE.0),
    ("fast sync read", Instruction::FAST_SYNC_READ.0),
    ("bulk read", Instruction::BULK_READ.0),
    ("bulk write", Instruction::BULK_WRITE.0),
    ("fast bulk read", Instruction::FAST_BULK_READ.0),
];

impl ProtocolVersion {
    /// Packets of the protocol, for faults of chosen ones. In protocol 1.0 an answer does not
    /// differ from a message of the host: one with an error may be taken for it at the stub of
    /// another servo.
    pub const fn frames(self) -> FrameReader {
        match self {
            Self::One => FrameReader {
                match_frame: |front| Self::One.match_frame(front),
                code: |frame| frame.get(4).copied(),
                kinds: KINDS,
            },
            Self::Two => FrameReader {
                match_frame: |front| Self::Two.match_frame(front),
                code: |frame| frame.get(7).copied(),
                kinds: KINDS,
            },
        }
    }
}
