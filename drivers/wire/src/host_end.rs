use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, Wire, WiringError, World};

use crate::{Line, Piece};

/// The host's end of a line that it has to itself, without USB in between: what it writes goes in at
/// once (paced by a [`crate::Uart`]), what arrives it can read a constant time later.
pub struct HostEnd<L> {
    latency: SimDuration,
    line: L,
}

impl<L: Line> HostEnd<L> {
    /// Of `line`; the host can read a byte `latency` after it is complete.
    pub fn new(latency: SimDuration, line: L) -> Self {
        Self { latency, line }
    }
}

impl<L: Line> Wire for HostEnd<L> {
    fn send(&mut self, now: SimTime, bytes: &[u8]) {
        self.line.send(Piece {
            first: now,
            spacing: self.latency,
            bytes,
        });
    }
    fn receive(&mut self, bytes: &mut Vec<u8>) {
        let _ = bytes;
    }
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.line.connect(owner, plant)
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.line.next_wake()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.line.advance(now, world)
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
