use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};

use crate::error::nonzero;
use crate::{Arrivals, Line, Node, Piece, WireError};

/// A half-duplex bus with several nodes, seen from its near end.
pub struct Rs485 {
    byte_time: SimDuration,
    turnaround: SimDuration,
    nodes: Vec<Box<dyn Node>>,
}

impl Rs485 {
    /// A bus on which a byte takes `byte_time`, and whose near end hears nothing until `turnaround` after it has talked
    /// itself. `name` is for its gauges: `sbcp/collisions`.
    ///
    /// # Errors
    /// [`WireError::Zero`] if `byte_time` is zero.
    pub fn new(
        name: &str,
        byte_time: SimDuration,
        turnaround: SimDuration,
        nodes: Vec<Box<dyn Node>>,
    ) -> Result<Self, WireError> {
        nonzero(name, "byte time", byte_time)?;
        Ok(Self {
            byte_time,
            turnaround,
            nodes,
        })
    }
}

impl Line for Rs485 {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.nodes
            .iter_mut()
            .try_for_each(|node| node.connect(owner, plant))
    }

    fn send(&mut self, piece: Piece<'_>) {
        let _ = (piece, self.byte_time, self.turnaround);
    }

    fn next_wake(&self) -> Option<SimTime> {
        self.nodes.iter().filter_map(|node| node.next_wake()).min()
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        self.nodes
            .iter_mut()
            .try_for_each(|node| node.advance(now, world))
    }

    fn receive(&mut self, arrivals: &mut Arrivals) {
        let _ = arrivals;
    }

    fn save(&self) -> Snapshot {
        Snapshot::default()
    }

    fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
        Ok(())
    }
}
