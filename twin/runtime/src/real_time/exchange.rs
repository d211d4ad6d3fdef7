use std::sync::Arc;
use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration};

use super::clock::{Clock, later};
use crate::{Device, DeviceError, Driver, Phase, TaskError, Transfer};

/// A driver at its device: what it does in each phase of its life, on whatever thread.
pub(super) struct Exchange {
    pub(super) driver: Box<dyn Driver>,
    device: Box<dyn Device>,
    clock: Arc<dyn Clock>,
    bytes: Vec<u8>,
}

/// Which way bytes pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Out,
    In,
}

/// What an exchange tells of itself while it goes on, and is told.
pub(super) trait Side {
    /// Bytes have just been written, or read.
    fn passed(&mut self, at: HostTime, way: Way, bytes: &[u8]);

    /// Whether to break off.
    fn is_called_off(&self) -> bool;
}

/// How an exchange ended, if nothing failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    Done(HostTime),
    CalledOff,
}

/// How long to wait for bytes before looking whether the exchange is called off.
const PATIENCE_MAX: Duration = Duration::from_millis(20);

impl Exchange {
    pub(super) fn new(
        driver: Box<dyn Driver>,
        device: Box<dyn Device>,
        clock: Arc<dyn Clock>,
    ) -> Self {
        Self {
            driver,
            device,
            clock,
            bytes: Vec::with_capacity(4096),
        }
    }

    /// Where the device is.
    pub(super) fn place(&self) -> &str {
        self.device.place()
    }

    /// Opens the devices.
    pub(super) fn open(
        &mut self,
        limit: SimDuration,
        side: &mut dyn Side,
    ) -> Result<Ending, TaskError> {
        self.driver.open(self.clock.now());
        self.go_on(Phase::Opening, limit, side)
    }

    /// One transfer. What has come since the last one is heard first.
    pub(super) fn transfer(
        &mut self,
        from_process: &[f64],
        limit: SimDuration,
        side: &mut dyn Side,
    ) -> Result<Ending, TaskError> {
        self.hear(Duration::ZERO, side)?;
        self.driver.begin(self.clock.now(), from_process);
        self.go_on(Phase::Transfer, limit, side)
    }

    /// Leaves the devices in a safe state.
    pub(super) fn close(
        &mut self,
        limit: SimDuration,
        side: &mut dyn Side,
    ) -> Result<Ending, TaskError> {
        self.driver.close(self.clock.now());
        self.go_on(Phase::Closing, limit, side)
    }

    /// Does what the driver wants between transfers, once the time has come; says when it wants more.
    pub(super) fn attend(
        &mut self,
        limit: SimDuration,
        side: &mut dyn Side,
    ) -> Result<Option<HostTime>, TaskError> {
        let due = |driver: &dyn Driver, now| driver.poll_timeout().is_some_and(|at| at <= now);
        let began = self.clock.now();
        if due(&*self.driver, began) {
            self.hear(Duration::ZERO, side)?;
            let now = self.clock.now();
            if due(&*self.driver, now) {
                self.driver.handle_timeout(now);
            }
            self.write(Phase::Transfer, limit, later(began, duration(limit)), side)?;
        }
        Ok(self.driver.poll_timeout())
    }

    /// Lets driver and device exchange bytes until the driver says that it is done.
    fn go_on(
        &mut self,
        what: Phase,
        limit: SimDuration,
        side: &mut dyn Side,
    ) -> Result<Ending, TaskError> {
        let deadline = later(self.clock.now(), duration(limit));
        loop {
            self.write(what, limit, deadline, side)?;
            let progress = self.driver.poll_transfer();
            let progress = progress.map_err(|error| TaskError::Device { why: error.why })?;
            let now = self.clock.now();
            if progress == Transfer::Done {
                return Ok(Ending::Done(now));
            }
            if now >= deadline {
                return Err(self.too_long(what, limit));
            }
            if side.is_called_off() && what != Phase::Closing {
                return Ok(Ending::CalledOff);
            }
            let until = self.driver.poll_timeout().unwrap_or(deadline).min(deadline);
            self.hear(until.since(now).min(PATIENCE_MAX), side)?;
            let now = self.clock.now();
            if self.driver.poll_timeout().is_some_and(|at| at <= now) {
                self.driver.handle_timeout(now);
            }
        }
    }

    /// Writes everything that the driver wants to be written.
    fn write(
        &mut self,
        what: Phase,
        limit: SimDuration,
        deadline: HostTime,
        side: &mut dyn Side,
    ) -> Result<(), TaskError> {
        loop {
            self.bytes.clear();
            if !self.driver.poll_transmit(&mut self.bytes) {
                return Ok(());
            }
            // The instant before, so that an answer cannot seem older than its question.
            let now = self.clock.now();
            if now >= deadline {
                return Err(self.too_long(what, limit));
            }
            self.device.write(&self.bytes)?;
            side.passed(now, Way::Out, &self.bytes);
        }
    }

    /// Reads what there is, or comes within `patience`.
    fn hear(&mut self, patience: Duration, side: &mut dyn Side) -> Result<(), DeviceError> {
        self.bytes.clear();
        self.device.read(patience, &mut self.bytes)?;
        if !self.bytes.is_empty() {
            let now = self.clock.now();
            self.driver.handle_bytes(now, &self.bytes);
            side.passed(now, Way::In, &self.bytes);
        }
        Ok(())
    }

    fn too_long(&self, what: Phase, limit: SimDuration) -> TaskError {
        TaskError::TimeLimit {
            what,
            place: self.place().into(),
            limit,
        }
    }
}

/// The same length of the machine's time.
pub(super) fn duration(of: SimDuration) -> Duration {
    Duration::from_nanos(of.as_nanos())
}
