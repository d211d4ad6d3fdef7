use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};
use twinrig_wire::{Arrivals, Line, Piece};

use crate::controller::{Controller, ControllerConfig, ControllerCounters};
use crate::error::SbcpError;

/// A bus behind a bus controller: the near end is the link to the host, the far end the bus.
pub struct Controlled<L: Line> {
    controller: Controller,
    bus: L,
}

impl<L: Line> Controlled<L> {
    /// Puts a controller before `bus`.
    ///
    /// # Errors
    /// [`SbcpError`] as [`Controller::new`].
    pub fn new(config: ControllerConfig, bus: L) -> Result<Self, SbcpError> {
        Ok(Self { controller: Controller::new(config)?, bus })
    }

    /// What the controller counted so far.
    pub fn counters(&self) -> ControllerCounters {
        self.controller.counters()
    }

    /// What is behind it.
    pub fn bus(&self) -> &L {
        &self.bus
    }
}

impl<L: Line> Line for Controlled<L> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.bus.connect(owner, plant)
    }

    fn send(&mut self, piece: Piece<'_>) {
        self.controller.handle_link(piece);
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.bus.next_wake()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.bus.advance(now, world)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.bus.receive(arrivals);
    }

    fn gauges(&self) -> Vec<Port> {
        self.bus.gauges()
    }

    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        self.bus.read_gauges(now, values);
    }

    fn lanes(&self) -> Vec<String> {
        self.bus.lanes()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.bus.drain_traffic(passed);
    }

    fn save(&self) -> Snapshot {
        self.bus.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.bus.restore(snapshot)
    }
}
