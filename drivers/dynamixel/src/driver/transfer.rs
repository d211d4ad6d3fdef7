//! Transfers: goals to all servos by one instruction, positions by one or several.

use twinrig_kernel::HostTime;
use twinrig_wire::TrafficError;

use super::{DynamixelDriver, Stage, number};
use crate::config::{ReadPattern, ServoConfig};
use crate::fast::FastParts;
use crate::protocol::{ProtocolVersion, Status};
use crate::request::{BulkReads, Request};

impl DynamixelDriver {
    /// Writes the goals, and begins to read.
    pub(super) fn begin_transfer(&mut self, now: HostTime) {
        let servos = &self.config.servos;
        let Some(model) = servos.first().map(ServoConfig::model) else {
            return;
        };
        let span = model.goal();
        self.writes.clear();
        for (servo, goal) in servos.iter().zip(&self.state.goals) {
            self.writes.push(servo.id);
            let goal = servo.model().goal_bytes(*goal);
            self.writes.extend(&goal[..usize::from(span.length).min(4)]);
        }
        let data = &self.writes;
        // The number of servos is checked: their goals fit into a packet.
        let goals = Request::SyncWrite { span, data };
        let _ = goals.encode(
            self.config.protocol(),
            ProtocolVersion::BROADCAST,
            &mut self.state.tx,
        );
        self.state.counters.transfers += 1;
        self.discard_beginning(now);
        self.read(now, 0);
    }

    /// Reads all positions, or that of a servo alone.
    fn read(&mut self, now: HostTime, index: usize) {
        let (protocol, pattern) = (self.config.protocol(), self.config.pattern);
        let span = self.servo(index).model().present();
        let ids = &self.ids;
        let (request, id, servos) = match pattern {
            ReadPattern::Read => (Request::Read(span), ids[index], index..index + 1),
            ReadPattern::SyncRead => (
                Request::SyncRead { span, ids },
                ProtocolVersion::BROADCAST,
                0..ids.len(),
            ),
            ReadPattern::FastSyncRead => {
                let request = Request::FastSyncRead { span, ids };
                (request, ProtocolVersion::BROADCAST, 0..ids.len())
            }
            ReadPattern::BulkRead => {
                let reads = BulkReads::new(protocol, &self.reads);
                (
                    Request::BulkRead(reads),
                    ProtocolVersion::BROADCAST,
                    0..ids.len(),
                )
            }
        };
        // The number of servos is checked.
        let _ = request.encode(protocol, id, &mut self.state.tx);
        self.state.stage = Stage::Reading(index);
        self.wait(now, servos.len(), span.length);
        for servo in servos {
            self.state.missing[servo] = true;
            self.state.traffic.request(Some(number(servo)), now);
        }
    }

    /// Handles the answer of a servo to a read.
    pub(super) fn handle_read(&mut self, now: HostTime, status: &Status<'_>) {
        let of_id = |servo: &ServoConfig| servo.id == status.id;
        let index = self.config.servos.iter().position(of_id);
        let Some(index) = index.filter(|index| self.state.missing[*index]) else {
            self.count_unexpected(index, now);
            return;
        };
        let model = self.servo(index).model();
        let refused = model.errors.of_byte(status.error).refused;
        let counts = model.counts(status.data);
        if !refused && counts.is_none() {
            self.count_unexpected(Some(index), now);
            return;
        }
        self.state.missing[index] = false;
        self.state.counters.answers += 1;
        self.state.traffic.answer(number(index), now);
        if let Some(counts) = counts.filter(|_| !refused) {
            self.state.to_process[index] = model.angle(counts);
        } else {
            self.state.counters.refused += 1;
            let kind = TrafficError::Refused;
            self.state.traffic.error(kind, Some(number(index)), 1, now);
        }
        if !self.state.missing.contains(&true) {
            self.continue_reading(now);
        }
    }

    /// Reads the next servo, or ends the transfer.
    pub(super) fn continue_reading(&mut self, now: HostTime) {
        self.state.until = None;
        match self.state.stage {
            Stage::Reading(index)
                if self.config.pattern == ReadPattern::Read
                    && index + 1 < self.config.servos.len() =>
            {
                self.read(now, index + 1);
            }
            _ => self.state.stage = Stage::Open,
        }
    }

    /// Handles the common answer to a fast read. A part is damaged where its own checksum is wrong:
    /// servos behind it have computed theirs over the bytes that they received.
    pub(super) fn handle_fast(&mut self, now: HostTime, parameters: &[u8]) {
        let length = usize::from(self.servo(0).model().present().length);
        for part in FastParts::new(parameters, length) {
            if let Some(status) = part {
                self.handle_read(now, &status);
            } else {
                self.state.counters.damaged += 1;
                let kind = TrafficError::Checksum;
                self.state.traffic.error(kind, None, 1, now);
            }
        }
    }
}
