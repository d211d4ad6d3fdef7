use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, TransmitBuffer, WiringError};

use crate::{Arrivals, Piece};

/// Returns the earlier of two optional instants.
pub fn earlier(one: Option<SimTime>, other: Option<SimTime>) -> Option<SimTime> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

/// Byte transport in virtual time, seen from its near end (towards the host), with everything at
/// its far end. Lines nest: one that changes bytes or times wraps the next.
///
/// The owner calls [`Line::advance`] at every instant of [`Line::next_wake`], in order, and at any
/// other instant at which it reads received bytes.
pub trait Line: Send {
    /// Resolves the plant signals that the boards sample and actuate.
    ///
    /// # Errors
    /// [`WiringError`] if the plant lacks a signal that a board requires.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// Transmits bytes from the near end. They may be announced before they are complete, even
    /// before the first one begins; pieces are in order of time and do not overlap.
    fn send(&mut self, piece: Piece<'_>);

    /// Returns the transmit buffer at the near end, if there is one.
    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        None
    }

    /// Returns the time of the next event that may be visible at the near end or act on the plant.
    /// Of contiguous bytes only the first and the last are reported. The value changes only by
    /// calls on `&mut self`.
    fn next_wake(&self) -> Option<SimTime>;

    /// Processes all events up to and including `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant or the transport fails.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Appends the bytes that were complete at the near end by the last [`Line::advance`] and not
    /// taken yet. Further bytes that are certain to arrive may be announced before they are
    /// complete; they need no wake-up.
    fn receive(&mut self, arrivals: &mut Arrivals);

    /// Returns the diagnostics (counters) as output ports, the same at every call.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the diagnostics at `now`, end to end, in order. Does not change the state.
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let _ = (now, values);
    }

    /// Returns the names of the byte traces, including those of the inner lines.
    fn traces(&self) -> Vec<String> {
        Vec::new()
    }

    /// Passes the bytes traced since the last call to `passed`, in order, with the index of the
    /// trace.
    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        let _ = passed;
    }

    /// Saves the complete state, including bytes in transit.
    fn save(&self) -> Snapshot;

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is of another kind of line.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
