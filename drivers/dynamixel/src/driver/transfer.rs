//! Transfers: goals to all servos by one instruction, positions by one or several.

use twinrig_kernel::HostTime;
use twinrig_wire::TrafficError;

use super::{DynamixelDriver, Stage, number};
use crate::config::{ReadPattern, ServoConfig};
use crate::protocol::{Protocol, Status};
use crate::request::{BulkReads, Request};

impl DynamixelDriver {
    /// Writes the goals, and begins to read.
    pub(super) fn begin_transfer(&mut self, now: HostTime) {
        let servos = &self.config.servos;
        let Some(model) = servos.first().map(|servo| servo.model) else {
            return;
        };
        let span = model.goal();
        self.writes.clear();
        for (servo, goal) in servos.iter().zip(&self.state.goals) {
            self.writes.push(servo.id);
            let goal = servo.model.goal_bytes(*goal);
            self.writes.extend(&goal[..usize::from(span.length).min(4)]);
        }
        let data = &self.writes;
        // The number of servos is checked: their goals fit into a packet.
        let goals = Request::SyncWrite { span, data };
        let _ = goals.encode(
            self.config.protocol(),
            Protocol::BROADCAST,
            &mut self.state.tx,
        );
        self.state.counters.transfers += 1;
        self.state.parser.reset();
        self.read(now, 0);
    }

    /// Reads all positions, or that of a servo alone.
    fn read(&mut self, now: HostTime, index: usize) {
        let (protocol, pattern) = (self.config.protocol(), self.config.pattern);
        let span = self.servo(index).model.present();
        let ids = &self.ids;
        let (request, id, servos) = match pattern {
            ReadPattern::Read => (Request::Read(span), ids[index], index..index + 1),
            ReadPattern::SyncRead => (
                Request::SyncRead { span, ids },
                Protocol::BROADCAST,
                0..ids.len(),
            ),
            ReadPattern::FastSyncRead => {
                let request = Request::FastSyncRead { span, ids };
                (request, Protocol::BROADCAST, 0..ids.len())
            }
            ReadPattern::BulkRead => {
                let reads = BulkReads::new(protocol, &self.reads);
                (Request::BulkRead(reads), Protocol::BROADCAST, 0..ids.len())
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
            self.state.counters.unexpected += 1;
            let kind = TrafficError::Unexpected;
            self.state.traffic.error(kind, index.map(number), 1, now);
            return;
        };
        let model = self.servo(index).model;
        self.state.missing[index] = false;
        self.state.counters.answers += 1;
        self.state.traffic.answer(number(index), now);
        match model.counts(status.data) {
            Some(counts) if !model.errors.of_byte(status.error).refused => {
                self.state.to_process[index] = model.angle(counts);
            }
            _ => {
                self.state.counters.refused += 1;
                let kind = TrafficError::Refused;
                self.state.traffic.error(kind, Some(number(index)), 1, now);
            }
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

    /// Handles the common answer to a fast read: error, identifier, data and CRC of each servo.
    pub(super) fn handle_fast(&mut self, now: HostTime, mut parameters: &[u8]) {
        let length = usize::from(self.servo(0).model.present().length);
        while let [error, id, rest @ ..] = parameters {
            let Some((data, behind)) = rest.split_at_checked(length) else {
                break;
            };
            let (id, error) = (*id, *error);
            self.handle_read(now, &Status { id, error, data });
            parameters = behind.get(2..).unwrap_or_default();
        }
    }
}
