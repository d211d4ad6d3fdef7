//! Opening, transfers and closing.

use twinrig_kernel::{Direction, Layout, SimDuration};
use twinrig_runtime::Driver;

use super::{Phase, Session, host};
use crate::laws::Violation;
use crate::laws::log::Transfer;

impl<D: Driver> Session<'_, D> {
    /// Ends the phase if the driver is done, and begins the next one if it is due.
    pub(super) fn update_phase(&mut self) -> Result<(), Violation> {
        loop {
            match self.phase {
                Phase::Ended => return Ok(()),
                Phase::Idle if self.now < self.slot_start() => return Ok(()),
                Phase::Idle => {
                    self.begin_slot();
                    self.write();
                }
                _ => match self.driver.is_busy() {
                    Ok(true) => return self.check_deadline(),
                    Ok(false) => self.end_phase(),
                    Err(error) => {
                        self.log.ended = Some((self.now, Err(error.why)));
                        self.phase = Phase::Ended;
                    }
                },
            }
        }
    }

    /// Returns the time within which the phase ends.
    pub(super) fn deadline(&self) -> SimDuration {
        match self.phase {
            Phase::Transfer(_) => self.setup.transfer_deadline,
            _ => self.setup.deadline,
        }
    }

    fn check_deadline(&self) -> Result<(), Violation> {
        let limit = self.deadline();
        if self.now <= self.since + limit {
            return Ok(());
        }
        let phase = self.phase;
        Err(self.violation(format!("{phase:?} has not ended within {limit}")))
    }

    fn end_phase(&mut self) {
        let values = self.driver.to_process().to_vec();
        let traffic = (self.setup.traffic)(&self.driver, host(self.now));
        match self.phase {
            Phase::Opening => {
                self.origin = self.now;
                self.log.first_values.push((self.now, values));
                self.log.opened = Some((self.to_driver.entered, traffic));
                self.phase = Phase::Idle;
            }
            Phase::Transfer(slot) => {
                self.log.transfers.push(Transfer {
                    slot,
                    at: self.now,
                    values,
                    diagnostics: self.diagnostics(),
                    traffic,
                    received: self.to_driver.entered,
                });
                let period = self.setup.period.as_nanos().max(1);
                let elapsed = (self.now - self.origin).as_nanos();
                let soonest = usize::try_from(elapsed.div_ceil(period)).unwrap_or(usize::MAX);
                self.next_slot = soonest.max(slot + 1);
                self.phase = Phase::Idle;
            }
            Phase::Closing => {
                self.log.ended = Some((self.now, Ok(())));
                self.phase = Phase::Ended;
            }
            Phase::Idle | Phase::Ended => {}
        }
    }

    /// Begins the transfer of the present slot, or closing after the last one.
    fn begin_slot(&mut self) {
        self.since = self.now;
        let now = host(self.now);
        if self.next_slot >= self.course.slots {
            self.phase = Phase::Closing;
            return self.driver.close(now);
        }
        self.phase = Phase::Transfer(self.next_slot);
        let inputs = Layout::of(&self.driver.ports(), Direction::Input).len();
        let commands = (0..inputs).map(|n| (self.setup.commands)(self.next_slot, n));
        self.driver.begin(now, &commands.collect::<Vec<_>>());
    }

    pub(super) fn diagnostics(&self) -> Vec<f64> {
        let ports = self.driver.diagnostics();
        let mut values = vec![0.0; Layout::of(&ports, Direction::Output).len()];
        self.driver.read_diagnostics(&mut values);
        values
    }
}
