use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};

use crate::Piece;

/// A device on a bus, with a life of its own: an emulated board.
///
/// The bus lets it hear what others put on the wires, up to now, and then calls [`Node::advance`]; it asks
/// for what the node wants to say after every such call, and for [`Node::attention`] and [`Node::next_wake`], which
/// change at no other time.
pub trait Node: Send {
    /// Name, for messages, gauges and faults: `LF`.
    fn name(&self) -> &str;

    /// Tells it where the plant has its signals.
    ///
    /// # Errors
    /// [`WiringError`] if the plant has not those that it cannot do without.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// Hears bytes that others put on the bus, complete by now, damaged ones included. It drops those with a framing error, and
    /// counts them.
    fn receive(&mut self, piece: Piece<'_>);

    /// How many bytes it must hear from now on before it can react to them, at least: what is still missing of
    /// the shortest packet. The bus lets it hear that byte on time. A node that does not say hears what a talker says
    /// when that is over, at the latest: enough if everybody says one packet at a time.
    fn attention(&self) -> Option<usize> {
        None
    }

    /// When it wants to be advanced next.
    fn next_wake(&self) -> Option<SimTime>;

    /// Lets everything happen in it up to and at `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Appends what it puts on the bus next to `bytes`, and says when its first bit is on the wires: now or
    /// later, and not before what it said last is over. None if it keeps quiet.
    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime>;

    /// The same, and whether the stop bits of those bytes are wrong: for what damages the words of a node.
    fn poll_transmit_framed(&mut self, bytes: &mut Vec<u8>) -> Option<(SimTime, bool)> {
        self.poll_transmit(bytes).map(|start| (start, false))
    }

    /// What can be seen of it: counters. Output ports, the same at every call.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the gauges at `now`, end to end, in order. Looking changes nothing.
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let _ = (now, values);
    }

    /// Saves everything that the way ahead depends on.
    fn save(&self) -> Snapshot;

    /// Goes back to a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is not of such a node.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
