use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError};

use crate::{Arrivals, Piece};

/// The earlier of two instants at which something is to happen, if at all.
pub fn earlier(one: Option<SimTime>, other: Option<SimTime>) -> Option<SimTime> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

/// A byte transport in virtual time with everything at its far end, as seen from its near end. Lines nest:
/// one that changes bytes or times is a small struct around the next.
///
/// Whoever holds it calls [`Line::advance`] at every instant of [`Line::next_wake`], in order, and at any
/// other instant at which it wants to know what has arrived.
pub trait Line: Send {
    /// Tells the boards where the plant has the signals that they sample and actuate.
    ///
    /// # Errors
    /// [`WiringError`] if the plant has not the signals that a board cannot do without.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// Puts bytes in at the near end. They may be announced before they are complete, even before the first
    /// begins; pieces come in order of time and do not overlap.
    fn send(&mut self, piece: Piece<'_>);

    /// The transmitter at its near end, if it has one: bytes wait there.
    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        None
    }

    /// When something happens next that may show at the near end or act on the plant. Of bytes that follow one
    /// another without a pause only the first and the last are named. It changes only when something is done to the
    /// line, so whoever holds it need not ask twice.
    fn next_wake(&self) -> Option<SimTime>;

    /// Lets everything happen up to and at `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails, or the transport is gone.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Appends what was complete at the near end by the last [`Line::advance`] and was not taken yet, and perhaps more
    /// that is sure to come: bytes may be announced before they are complete, and need then no wake-up of their own.
    fn receive(&mut self, arrivals: &mut Arrivals);

    /// What can be seen of it: counters. Output ports, the same at every call.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the gauges at `now`, end to end, in order. Looking changes nothing.
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let _ = (now, values);
    }

    /// Names of the lanes on which bytes are traced, those of what is inside included.
    fn traces(&self) -> Vec<String> {
        Vec::new()
    }

    /// Hands over what has passed since the last call, in order, by number of the lane.
    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        let _ = passed;
    }

    /// Saves everything that the way ahead depends on, bytes under way included.
    fn save(&self) -> Snapshot;

    /// Goes back to a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is not of such a line.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
