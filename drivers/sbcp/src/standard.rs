use crate::codes::{ErrorCode, Instruction};
use crate::packet::{Payload, Request};
use crate::registers::RegisterTable;

/// What a standard instruction changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    Nothing,
    Written { address: u8, value: u16 },
    Saved,
}

/// Does what every device does in the same way: ping, get, set, save. Gives the payload of the answer, or
/// its error.
pub(crate) fn obey(
    registers: &mut RegisterTable,
    request: &Request,
) -> Result<(Payload, Change), ErrorCode> {
    let nothing = Payload::default();
    match (request.instruction, &request.payload[..]) {
        (Instruction::PING, []) => Ok((nothing, Change::Nothing)),
        (Instruction::GET, &[address]) => {
            let (width, value) = registers.read(address)?;
            Ok((Payload::of_register(width, value), Change::Nothing))
        }
        (Instruction::SET, &[address, ref bytes @ ..]) => {
            let value = registers.write(address, bytes)?;
            Ok((nothing, Change::Written { address, value }))
        }
        (Instruction::SAVE, []) => {
            registers.save();
            Ok((nothing, Change::Saved))
        }
        (Instruction::PING | Instruction::GET | Instruction::SET | Instruction::SAVE, _) => {
            Err(ErrorCode::BAD_LENGTH)
        }
        _ => Err(ErrorCode::UNKNOWN_INSTRUCTION),
    }
}
