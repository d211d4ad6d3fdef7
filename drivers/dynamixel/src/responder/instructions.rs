//! Execution of instructions.

use twinrig_kernel::SimTime;

use super::Responder;
use crate::codes::ErrorNumber;
use crate::request::{Kept, Request, bulk_of_servo, of_servo};

impl Responder {
    /// Executes an instruction, to this servo or to all.
    pub(super) fn execute(&mut self, now: SimTime, request: Request<'_>, to_all: bool) {
        let id = self.id();
        match request {
            Request::Ping => self.answer_ping(now, to_all),
            Request::Read(span) if !to_all => self.answer_read(now, span),
            Request::Read(_) => {}
            Request::Write { address, data } => {
                let written = self.registers.write(address, data);
                self.confirm(now, written, to_all);
            }
            Request::RegWrite { address, data } => {
                // Refused at once, as far as it can be known.
                let written = self.registers.clone().write(address, data);
                if written.is_ok() {
                    self.state.registered = Some((address, data.to_vec()));
                    self.set_registered(1);
                }
                self.confirm(now, written, to_all);
            }
            Request::Action => {
                let written = match self.state.registered.take() {
                    Some((address, data)) => self.registers.write(address, &data),
                    None => Err(ErrorNumber::INSTRUCTION),
                };
                self.set_registered(0);
                self.confirm(now, written, to_all);
            }
            Request::FactoryReset(kept) => {
                // All servos would have the same identifier afterwards.
                let refused = to_all && kept == Kept::Nothing;
                self.confirm(now, Ok(()), to_all);
                if !refused {
                    self.registers.factory_reset(kept);
                    self.state.registered = None;
                    self.state.restarts = true;
                }
            }
            Request::Reboot => {
                self.confirm(now, Ok(()), to_all);
                self.registers.restart();
                self.state.registered = None;
                self.state.restarts = true;
            }
            Request::ClearTurns => {
                let moving = self.registers.get(self.registers.model().roles.moving) != 0;
                self.state.clears_turns |= !moving;
                let done = if moving {
                    Err(ErrorNumber::RESULT_FAIL)
                } else {
                    Ok(())
                };
                self.confirm(now, done, to_all);
            }
            Request::SyncRead { span, ids } => {
                let reads = ids.iter().map(|id| (*id, span));
                self.read_in_turn(now, reads);
            }
            Request::BulkRead(reads) => self.read_in_turn(now, reads.iter()),
            Request::FastSyncRead { span, ids } => {
                let reads = ids.iter().map(|id| (*id, span));
                self.read_fast(now, reads);
            }
            Request::FastBulkRead(reads) => self.read_fast(now, reads.iter()),
            Request::SyncWrite { span, data } => {
                if let Some(bytes) = of_servo(span, data, id) {
                    let written = self.registers.write(span.address, bytes);
                    self.confirm(now, written, true);
                }
            }
            Request::BulkWrite(data) => {
                if let Some((address, bytes)) = bulk_of_servo(data, id) {
                    let written = self.registers.write(address, bytes);
                    self.confirm(now, written, true);
                }
            }
        }
    }

    fn set_registered(&mut self, value: i32) {
        if let Some(address) = self.registers.model().roles.registered {
            self.registers.set(address, value);
        }
    }
}
