//! Opening and closing: the steps of one servo after the other.

use twinrig_kernel::HostTime;

use super::step::{Step, StepOutcome, steps};
use super::{DynamixelDriver, Stage, number};
use crate::config::ServoConfig;
use crate::protocol::Status;

/// Number of attempts at each request when opening and closing.
const ATTEMPTS: u32 = 3;

impl DynamixelDriver {
    /// Returns the present step of opening or closing, and its servo.
    fn step(&self) -> Option<(usize, Step)> {
        match self.state.stage {
            Stage::Opening(index, step) => Some((index, steps(self.servo(index)).nth(step)?)),
            Stage::Closing(index) => Some((index, Step::torque(self.servo(index), false))),
            Stage::Closed | Stage::Open | Stage::Reading(_) => None,
        }
    }

    /// Begins the present step of opening or closing.
    pub(super) fn request_step(&mut self, now: HostTime) {
        let Some((index, step)) = self.step() else {
            return;
        };
        let id = self.servo(index).id;
        self.state.attempts += 1;
        // A step fits into a packet.
        let protocol = self.config.protocol();
        let _ = step.request().encode(protocol, id, &mut self.state.tx);
        self.wait(now, 1, 4);
        self.state.traffic.request(Some(number(index)), now);
    }

    /// Repeats the present step of opening or closing; after the last attempt it fails.
    pub(super) fn repeat_step(&mut self, now: HostTime) {
        let Some((index, _)) = self.step() else {
            return;
        };
        if self.state.attempts < ATTEMPTS {
            self.request_step(now);
            return;
        }
        let ServoConfig { name, id, .. } = self.servo(index);
        let why = if matches!(self.state.stage, Stage::Closing(_)) {
            format!(
                "{name} (id {id}) did not confirm any of {ATTEMPTS} instructions to turn its \
                 torque off: it may still be on"
            )
        } else {
            format!(
                "{name} (id {id}) answered none of {ATTEMPTS} instructions: check power, cable, \
                 baud rate and identifier"
            )
        };
        self.fail_step(now, why);
    }

    /// Ends the present step of opening or closing, and begins the next one.
    fn end_step(&mut self, now: HostTime) {
        let servos = self.config.servos.len();
        let state = &mut self.state;
        state.attempts = 0;
        state.until = None;
        state.stage = match state.stage {
            Stage::Opening(index, step) => {
                if step + 1 < steps(&self.config.servos[index]).count() {
                    Stage::Opening(index, step + 1)
                } else if index + 1 < servos {
                    Stage::Opening(index + 1, 0)
                } else {
                    state.traffic.forget_silences();
                    Stage::Open
                }
            }
            Stage::Closing(index) if index + 1 < servos => Stage::Closing(index + 1),
            Stage::Closing(_) => Stage::Closed,
            other => other,
        };
        self.request_step(now);
    }

    /// Ends the opening, or turns off the torque of the other servos.
    fn fail_step(&mut self, now: HostTime, why: String) {
        self.state.failed.get_or_insert(why);
        if matches!(self.state.stage, Stage::Closing(_)) {
            self.end_step(now);
        } else {
            self.state.until = None;
            self.state.stage = Stage::Closed;
        }
    }

    /// Handles the answer of a servo to a step of opening or closing.
    pub(super) fn handle_step(&mut self, now: HostTime, status: &Status<'_>) {
        let step = self.step();
        let step = step.filter(|(index, _)| self.servo(*index).id == status.id);
        let outcome = step.map(|(index, step)| (index, step.outcome(self.servo(index), status)));
        let Some((index, outcome)) = outcome.filter(|(_, it)| *it != StepOutcome::Unexpected)
        else {
            self.count_unexpected(None, now);
            return;
        };
        self.state.traffic.answer(number(index), now);
        self.state.counters.answers += 1;
        match outcome {
            StepOutcome::Done | StepOutcome::Unexpected => self.end_step(now),
            StepOutcome::Located(counts) => {
                self.state.to_process[index] = self.servo(index).model().angle(counts);
                self.state.goals[index] = counts;
                self.end_step(now);
            }
            StepOutcome::Repeat => self.repeat_step(now),
            StepOutcome::Failed(why) => {
                let ServoConfig { name, id, .. } = self.servo(index);
                let why = format!("{name} (id {id}): {why}");
                self.fail_step(now, why);
            }
        }
    }
}
