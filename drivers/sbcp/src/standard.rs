use crate::codes::{ErrorCode, Instruction};
use crate::packet::{Payload, Request};
use crate::registers::RegisterTable;

/// Change made by a standard instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    Unchanged,
    Written { address: u8, value: u16 },
    Saved,
}

/// Executes the instructions common to all devices: ping, get, set, save. Returns the payload of
/// the answer, or its error.
pub(crate) fn execute_standard(
    registers: &mut RegisterTable,
    request: &Request,
) -> Result<(Payload, Change), ErrorCode> {
    let empty = Payload::default();
    match (request.instruction, &request.payload[..]) {
        (Instruction::PING, []) => Ok((empty, Change::Unchanged)),
        (Instruction::GET, &[address]) => {
            let (width, value) = registers.read(address)?;
            Ok((Payload::of_register(width, value), Change::Unchanged))
        }
        (Instruction::SET, &[address, ref bytes @ ..]) => {
            let value = registers.write(address, bytes)?;
            Ok((empty, Change::Written { address, value }))
        }
        (Instruction::SAVE, []) => {
            registers.save();
            Ok((empty, Change::Saved))
        }
        (Instruction::PING | Instruction::GET | Instruction::SET | Instruction::SAVE, _) => {
            Err(ErrorCode::BAD_LENGTH)
        }
        _ => Err(ErrorCode::UNKNOWN_INSTRUCTION),
    }
}
