use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};

use crate::{Arrivals, Line, Piece};

/// Hands what passes to the recording, on two lanes: `NAME/out` away from the near end, `NAME/in` towards it.
pub struct Traced<L> {
    name: String,
    line: L,
}

impl<L: Line> Traced<L> {
    /// Around `line`; `rs485`, within a task `sbcp`, becomes `sbcp/rs485/out` and `sbcp/rs485/in`.
    pub fn new(name: impl Into<String>, line: L) -> Self {
        Self {
            name: name.into(),
            line,
        }
    }
}

impl<L: Line> Line for Traced<L> {
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
