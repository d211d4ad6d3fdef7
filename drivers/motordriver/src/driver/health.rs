//! Health of the bus, and the reason why it is given up.

use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration};
use twinrig_runtime::BusHealth;
use twinrig_sbcp::{ErrorCode, Master, RequestError};

use super::{Stage, State};
use crate::config::SessionConfig;

/// Wait for late answers before the bus is given up: the reason names late boards and silent ones.
/// ASSUMED; a quarter of the time after which boards without commands drop their motors.
const LATE_WAIT: Duration = Duration::from_millis(5);

impl State {
    /// Returns the health of the bus. The period is that of a cycle: the nominal one, or the mean
    /// one of a bus that needs longer.
    pub(super) fn bus_health(&self, now: HostTime, config: &SessionConfig) -> BusHealth {
        let nominal = u64::try_from(config.period.as_nanos()).unwrap_or(u64::MAX);
        let period = SimDuration::from_nanos(nominal.max(self.cycles.mean_ns()));
        let name = |device| self.board_name(device);
        self.master.traffic().health(now, Some(period), name)
    }

    fn board_name(&self, device: u16) -> String {
        let mut boards = self.boards.iter();
        match boards.find(|board| device == board.device()) {
            Some(board) => board.to_string(),
            None => format!("device {device:#06x}"),
        }
    }

    /// Begins to give up the bus, if the number of errors has reached the threshold: late answers
    /// are awaited first.
    pub(super) fn check_threshold(&mut self, now: HostTime) {
        if self.master.outcomes().iter().any(Result::is_err)
            && self.master.error_threshold_reached()
        {
            self.stage = Stage::Failing(now + LATE_WAIT);
            self.await_late_answers(now, now + LATE_WAIT);
        }
    }

    /// Gives up the bus when no late answer is expected any more.
    pub(super) fn await_late_answers(&mut self, now: HostTime, until: HostTime) {
        if now < until && self.master.may_answer_late(now) {
            return;
        }
        self.stage = Stage::Open;
        let errors = self.master.counters().errors;
        let threshold = self.master.config().error_threshold;
        self.failed = Some(format!(
            "{} (error {errors}; the bus is given up at {threshold})",
            self.failures()
        ));
    }

    /// Returns the failures of the last cycle, with the boards of each: late ones first.
    fn failures(&self) -> String {
        let mut failures: Vec<(String, Vec<String>)> = Vec::new();
        let outcomes = self.master.outcomes();
        let silent = Err(RequestError::Refused(ErrorCode::TIMEOUT));
        let all_silent = outcomes.len() > 1 && outcomes.iter().all(|outcome| *outcome == silent);
        let used = self.boards.iter().filter(|board| board.is_used());
        let cycle = used.zip(&self.frame).zip(outcomes);
        for ((board, request), outcome) in cycle {
            let Err(failure) = outcome else { continue };
            let late = self.master.traffic().lateness(Master::device(request.to));
            let reason = match late {
                Some((_, worst)) => format!("{failure} in time, but up to {worst} late"),
                None => failure.to_string(),
            };
            match failures.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, boards)) => boards.push(board.to_string()),
                None => failures.push((reason, vec![board.to_string()])),
            }
        }
        let failures = failures
            .iter()
            .map(|(reason, boards)| format!("{}: {reason}", boards.join(", ")));
        let failures = failures.collect::<Vec<_>>().join("; ");
        if all_silent {
            // The bus controller waits for microseconds and drops what comes later.
            format!("{failures} to the bus controller, all at once: late, or cut off from it")
        } else {
            failures
        }
    }
}
