use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, Wire, WiringError, World};

use crate::{Arrivals, Line, Piece};

/// The host's end of a line that it has to itself, without USB in between: what it writes goes in at once, for a
/// [`crate::Uart`] to pace, and what arrives it can read as soon as it is complete.
pub struct HostEnd<L> {
    line: L,
    arrived: Arrivals,
}

impl<L: Line> HostEnd<L> {
    /// Of `line`.
    pub fn new(line: L) -> Self {
        Self {
            line,
            arrived: Arrivals::default(),
        }
    }
}

impl<L: Line> Wire for HostEnd<L> {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)
    }

    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        self.line.send(Piece {
            first: now,
            spacing: SimDuration::ZERO,
            bytes,
        });
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.line.next_wake()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.line.advance(now, world)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) {
        self.line.receive(&mut self.arrived);
        bytes.extend_from_slice(self.arrived.bytes());
        self.arrived.clear();
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
