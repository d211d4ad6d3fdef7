use twinrig_kernel::{Port, SimTime, Snapshot, SnapshotError};

use crate::{PlantSignals, TaskError, WiringError, World};

/// Everything that stands right of a driver, in virtual time: the transport with its timing, and the
/// emulated boards at its far end. It meets the driver through bytes and the plant through signals.
///
/// Whoever holds it calls [`Wire::advance`] at every instant of [`Wire::next_wake`], and before each
/// [`Wire::send`] and [`Wire::receive`].
pub trait Wire: Send {
    /// Tells the boards where the plant has the signals that they sample and actuate.
    ///
    /// # Errors
    /// [`WiringError`] if the plant has not the signals that a board cannot do without.
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError>;

    /// The host writes `bytes` at `now`, in one piece.
    fn send(&mut self, now: SimTime, bytes: &[u8]);

    /// When something happens next of which the host may learn, or that acts on the plant.
    fn next_wake(&self) -> Option<SimTime>;

    /// Lets everything happen up to and at `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails, or the port is gone.
    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError>;

    /// Appends the bytes that the host can read now and has not read yet.
    fn receive(&mut self, bytes: &mut Vec<u8>);

    /// What can be seen of transport and boards: counters. Output ports, the same at every call.
    fn gauges(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the gauges at `now`, end to end, in order. Looking changes nothing.
    fn read_gauges(&self, now: SimTime, values: &mut [f64]) {
        let _ = (now, values);
    }

    /// Names of the lanes of the transport on which bytes are traced: `rs485`.
    fn lanes(&self) -> Vec<String> {
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
    /// [`SnapshotError`] if the snapshot is not of such a wire.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
