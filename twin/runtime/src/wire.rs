use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};

use crate::{PlantAccess, PlantSignals, TaskError, WiringError};

/// The transmit buffer of a serial port or converter, and the transmitter that empties it at the baud rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransmitBuffer {
    /// When everything that was written so far is sent.
    pub idle_from: SimTime,
    /// Time on the line of a byte.
    pub byte_time: SimDuration,
    /// How much it holds \[bytes\].
    pub capacity: usize,
}

impl TransmitBuffer {
    /// How many bytes it takes at `now` without making the writer wait. Time before the transmitter begins counts as if it
    /// were sending.
    pub fn room(&self, now: SimTime) -> usize {
        let busy = self.idle_from.checked_since(now).unwrap_or_default();
        let unsent = busy.as_nanos().div_ceil(self.byte_time.as_nanos().max(1));
        self.capacity
            .saturating_sub(usize::try_from(unsent).unwrap_or(usize::MAX))
    }
}

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

    /// The host writes more at `now`, at the pace of its program, while the transmitter is busy or just idle
    /// ([`TransmitBuffer::idle_from`]): these bytes follow the earlier ones without a pause, as in one piece.
    fn send_on(&mut self, now: SimTime, bytes: &[u8]) {
        self.send(now, bytes);
    }

    /// What is between the host and the line, if that has a limit. A host that obeys it writes no more than there is room for.
    fn transmit_buffer(&self) -> Option<TransmitBuffer> {
        None
    }

    /// When something happens next of which the host may learn, or that acts on the plant.
    fn next_wake(&self) -> Option<SimTime>;

    /// Lets everything happen up to and at `now`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails, or the port is gone.
    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError>;

    /// Appends the bytes that the host can read now and has not read yet.
    fn receive(&mut self, bytes: &mut Vec<u8>);

    /// What can be seen of transport and boards: counters. Output ports, the same at every call.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the gauges at `now`, end to end, in order. Looking changes nothing.
    fn read_diagnostics(&self, now: SimTime, values: &mut [f64]) {
        let _ = (now, values);
    }

    /// Names of the lanes of the transport on which bytes are traced: `rs485`.
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
    /// [`SnapshotError`] if the snapshot is not of such a wire.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
