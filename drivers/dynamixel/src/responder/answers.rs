//! Answers, by status return level, return delay and kind of error.

use twinrig_kernel::{SimDuration, SimTime};

use super::Responder;
use crate::codes::{ErrorNumber, Errors};
use crate::protocol::{ProtocolVersion, Status};
use crate::request::Span;
use crate::table::ReturnDelay;

/// Unit of the return delay time.
const RETURN_DELAY_UNIT: SimDuration = SimDuration::from_micros(2);
/// Greatest return delay: 254 units.
pub(super) const RETURN_DELAY_MAX: SimDuration = SimDuration::from_micros(508);
/// Pause between the answers of two successive identifiers to a ping to all, beside the answer
/// itself. The vendor's library waits for so long for each (`dynamixel_sdk` 4.1, `broadcastPing`).
/// ASSUMED.
const PING_PAUSE: SimDuration = SimDuration::from_millis(3);
/// Bytes of the answer to a ping.
const PING_BYTES: u64 = 14;

impl Responder {
    /// Answers a ping: at once, or in the slot of this identifier.
    pub(super) fn answer_ping(&mut self, now: SimTime, to_all: bool) {
        if to_all {
            let slot = (self.byte_time * PING_BYTES + PING_PAUSE) * u64::from(self.id());
            self.state.slot = Some(now + slot);
            return;
        }
        let roles = self.registers.model().roles;
        self.data.clear();
        if self.protocol() == ProtocolVersion::Two {
            for (address, length) in [(roles.model, 2), (roles.firmware, 1)] {
                // Both are in the table.
                let span = Span { address, length };
                let _ = self.registers.read(span, &mut self.data);
            }
        }
        self.transmit(now, ErrorNumber::OK);
    }

    pub(super) fn answer_read(&mut self, now: SimTime, span: Span) {
        self.data.clear();
        match self.registers.read(span, &mut self.data) {
            Ok(()) => self.answer_data(now, ErrorNumber::OK),
            Err(error) => {
                self.state.counters.refused += 1;
                self.data.clear();
                if self.reports_refusals() {
                    self.answer_data(now, error);
                }
            }
        }
    }

    /// Answers an instruction to read.
    fn answer_data(&mut self, now: SimTime, error: ErrorNumber) {
        if self.answers_reads() {
            self.transmit(now, error);
        }
    }

    /// Answers an instruction without data.
    pub(super) fn confirm(&mut self, now: SimTime, done: Result<(), ErrorNumber>, to_all: bool) {
        match done {
            Ok(()) => self.answer(now, ErrorNumber::OK, to_all),
            Err(error) => self.refuse(now, error, to_all),
        }
    }

    pub(super) fn refuse(&mut self, now: SimTime, error: ErrorNumber, to_all: bool) {
        self.state.counters.refused += 1;
        if self.reports_refusals() {
            self.answer(now, error, to_all);
        }
    }

    /// Whether answers have errors of instructions. A servo without does not answer what it does
    /// not execute. ASSUMED.
    pub(super) fn reports_refusals(&self) -> bool {
        self.registers.model().errors != Errors::Hardware
    }

    pub(super) fn answer(&mut self, now: SimTime, error: ErrorNumber, to_all: bool) {
        if !to_all && self.answers_all() {
            self.data.clear();
            self.transmit(now, error);
        }
    }

    fn status_level(&self) -> i32 {
        let roles = &self.registers.model().roles;
        self.registers.get(roles.status_level) + roles.status_offset
    }

    pub(super) fn answers_reads(&self) -> bool {
        self.status_level() >= 1
    }

    fn answers_all(&self) -> bool {
        self.status_level() >= 2
    }

    pub(super) fn return_delay(&self) -> SimDuration {
        match self.registers.model().roles.return_delay {
            ReturnDelay::Fixed(delay) => delay,
            ReturnDelay::Register(address) => {
                let units = self.registers.get(address);
                RETURN_DELAY_UNIT * u64::try_from(units).unwrap_or_default()
            }
        }
    }

    pub(super) fn error_byte(&self, error: ErrorNumber) -> u8 {
        let model = self.registers.model();
        let hardware = model.roles.hardware_error;
        let [hardware, ..] = match hardware {
            Some(address) => self.registers.get(address).to_le_bytes(),
            None => [self.registers.alarms(), 0, 0, 0],
        };
        model.errors.byte(error, hardware)
    }

    /// Transmits `data` with an error, after the return delay.
    fn transmit(&mut self, now: SimTime, error: ErrorNumber) {
        let before = self.state.bytes.len();
        let status = Status {
            id: self.id(),
            error: self.error_byte(error),
            data: &self.data,
        };
        let protocol = self.protocol();
        // An answer is shorter than the longest packet: the table is.
        if protocol
            .encode_status(&status, &mut self.state.bytes)
            .is_ok()
        {
            self.queue(now + self.return_delay(), before);
        }
    }

    /// Queues the bytes from `first` on for transmission from `start` on, or after the one before.
    pub(super) fn queue(&mut self, start: SimTime, first: usize) {
        let start = start.max(self.state.transmitted);
        let length = self.state.bytes.len() - first;
        self.state.transmitted = start + self.byte_time * length as u64;
        self.state.pending.push_back((start, length));
        self.state.counters.answers += 1;
    }
}
