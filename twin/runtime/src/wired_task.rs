use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, HostTime, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError,
};

use crate::traced_wire::TracedWire;
use crate::{
    BusHealth, Driver, DriverError, DriverPhase, IoTask, Part, PartKind, PlantAccess, Progress,
    TaskError, Wire, in_part,
};

/// A driver and its modelled wire, boards included: a task of the lockstep executor.
///
/// The host reads at the instant at which the wire has bytes for it, and writes at the same
/// instant.
pub struct WiredTask {
    driver: Box<dyn Driver>,
    wire: TracedWire,
    busy: bool,
    /// Phase of which the wire knows; none at the start and after a restoration.
    phase: Option<DriverPhase>,
    /// [`Driver::poll_timeout`], updated after every call that changes the driver.
    timeout: Option<SimTime>,
    /// Whether the wire records bytes, each at its own instant.
    traced: bool,
    /// Number of diagnostics of the driver; those of the wire follow.
    driver_diagnostics: usize,
    /// Buffer of the bytes being written.
    bytes: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    busy: bool,
    driver: Snapshot,
    wire: Snapshot,
}

/// Converts to the time of the driver's clock, which shows physical time.
fn host_time(now: SimTime) -> HostTime {
    HostTime::from_nanos(now.as_nanos())
}

/// Returns the time-out of the driver in simulated time.
fn timeout(driver: &dyn Driver) -> Option<SimTime> {
    let timeout = driver.poll_timeout();
    timeout.map(|at| SimTime::from_nanos(at.as_nanos()))
}

fn device_error(error: DriverError) -> TaskError {
    TaskError::Device { why: error.why }
}

impl WiredTask {
    /// Creates the task of a driver and its wire.
    pub fn new(driver: Box<dyn Driver>, wire: Box<dyn Wire>) -> Self {
        Self {
            driver_diagnostics: Layout::of(&driver.diagnostics(), Direction::Output).len(),
            traced: !wire.traces().is_empty(),
            wire: TracedWire::new(driver.name().to_owned(), wire),
            phase: None,
            timeout: timeout(&*driver),
            driver,
            busy: false,
            bytes: Vec::new(),
        }
    }

    /// Tells the wire that a phase begins: the first transfer, not each.
    fn begin_phase(&mut self, now: SimTime, phase: DriverPhase) {
        if self.phase != Some(phase) {
            self.phase = Some(phase);
            self.wire.begin_phase(now, phase);
        }
    }

    /// Exchanges bytes between driver and wire until neither has any left at this time; `read`:
    /// beginning with those that were read.
    fn exchange(
        &mut self,
        now: SimTime,
        mut read: bool,
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        // What the driver has written may be answered at once.
        while self.serve_driver(now, read) || self.is_due(now) {
            read = self.wire.receive(now, plant)?;
        }
        if self.busy {
            let busy = in_part(PartKind::Driver, &self.wire.name, || self.driver.is_busy());
            self.busy = busy.map_err(device_error)?;
        }
        Ok(self.progress(now))
    }

    /// Exchanges bytes after a call of the driver.
    fn begin_exchange(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        let read = self.wire.receive(now, plant)?;
        self.exchange(now, read, plant)
    }

    /// Returns whether the time-out of the driver is due.
    fn is_due(&self, now: SimTime) -> bool {
        self.timeout.is_some_and(|at| at <= now)
    }

    fn progress(&self, now: SimTime) -> Progress {
        if self.busy {
            // A transfer without a wake-up never ends; the manager then reports the task as busy.
            let wake = self.idle_wake().unwrap_or(SimTime::MAX);
            Progress::WakeAt(wake.max(now))
        } else {
            Progress::Done
        }
    }

    /// Passes the bytes read, if any, and the time to the driver, and its bytes to the wire;
    /// returns whether there are any.
    fn serve_driver(&mut self, now: SimTime, read: bool) -> bool {
        let (driver, bytes) = (&mut self.driver, &self.wire.received);
        in_part(PartKind::Driver, &self.wire.name, || {
            if read {
                driver.handle_bytes(host_time(now), bytes);
            }
            if driver.poll_timeout().is_some_and(|at| at <= host_time(now)) {
                driver.handle_timeout(host_time(now));
            }
        });
        let mut wrote = false;
        while self.transmit() {
            wrote = true;
            self.wire
                .send(&self.bytes, |wire, bytes| wire.send(now, bytes));
        }
        self.timeout = timeout(&*self.driver);
        wrote
    }

    /// Reads the next bytes to be written from the driver; returns whether there are any.
    fn transmit(&mut self) -> bool {
        let (driver, bytes) = (&mut self.driver, &mut self.bytes);
        bytes.clear();
        in_part(PartKind::Driver, &self.wire.name, || {
            driver.poll_transmit(bytes)
        })
    }
}

impl Part for WiredTask {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&self.wire)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut self.wire)
    }

    fn diagnostics(&self) -> Vec<Port> {
        let mut diagnostics = self.driver.diagnostics();
        diagnostics.extend(self.wire.diagnostics());
        diagnostics
    }

    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let (driver, wire) = values.split_at_mut(self.driver_diagnostics);
        self.driver.read_diagnostics(driver);
        self.wire.read_diagnostics(now, wire);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            busy: self.busy,
            driver: self.driver.save(),
            wire: self.wire.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        self.driver.restore(&saved.driver)?;
        self.wire.restore(&saved.wire)?;
        self.busy = saved.busy;
        self.phase = None;
        self.timeout = timeout(&*self.driver);
        Ok(())
    }
}

impl IoTask for WiredTask {
    fn name(&self) -> &str {
        self.driver.name()
    }

    fn ports(&self) -> Vec<Port> {
        self.driver.ports()
    }

    fn open(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        self.busy = true;
        self.begin_phase(now, DriverPhase::Opening);
        let driver = &mut self.driver;
        in_part(PartKind::Driver, &self.wire.name, || {
            driver.open(host_time(now));
        });
        self.begin_exchange(now, plant)
    }

    fn begin(
        &mut self,
        now: SimTime,
        from_process: &[f64],
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        self.busy = true;
        self.begin_phase(now, DriverPhase::Transfer);
        let driver = &mut self.driver;
        in_part(PartKind::Driver, &self.wire.name, || {
            driver.begin(host_time(now), from_process);
        });
        self.begin_exchange(now, plant)
    }

    /// Handles the events of the wire until there is something for the driver.
    fn wake(
        &mut self,
        mut now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        loop {
            let read = self.wire.receive(now, plant)?;
            if read || self.is_due(now) {
                return self.exchange(now, read, plant);
            }
            if self.traced {
                return Ok(self.progress(now));
            }
            let before = self.timeout.unwrap_or(SimTime::MAX);
            now = self.wire.run_ahead(now, before, plant)?;
            match self.idle_wake() {
                Some(at) if plant.run_ahead(at) => now = at,
                _ => return Ok(self.progress(now)),
            }
        }
    }

    fn idle_wake(&self) -> Option<SimTime> {
        match (self.wire.wire.next_wake(), self.timeout) {
            (Some(wire), Some(driver)) => Some(wire.min(driver)),
            (wire, driver) => wire.or(driver),
        }
    }

    fn to_process(&self) -> &[f64] {
        self.driver.to_process()
    }

    fn period(&self) -> Option<SimDuration> {
        self.driver.period()
    }

    fn bus_health(&self, now: SimTime) -> Option<BusHealth> {
        let mut health = self.driver.bus_health(host_time(now))?;
        self.wire.report_health(&mut health);
        health.errors.sort_by_key(|error| error.first);
        Some(health)
    }
}
