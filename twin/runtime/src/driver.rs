use thiserror::Error;
use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError};

/// Master-side protocol code, without input or output of its own: bytes and times in, bytes and wake-up
/// times out. The same driver talks to a modelled [`crate::Wire`] in virtual time and to a real
/// [`crate::Device`] in real time, and cannot tell which.
///
/// An executor calls [`Driver::open`] once, then [`Driver::begin`] for each transfer, and
/// [`Driver::close`] once. After each of these, and whenever bytes have come ([`Driver::handle_bytes`]) or
/// the time has that [`Driver::poll_timeout`] asked for ([`Driver::handle_timeout`]), it
///
/// 1. writes what [`Driver::poll_transmit`] gives, until that gives nothing;
/// 2. asks [`Driver::poll_transfer`] whether opening, the transfer or closing is over.
pub trait Driver: Send {
    /// Name, for messages, gauges and recordings: that of its bus in the scenario.
    fn name(&self) -> &str;

    /// Output ports are data that it brings to the process, input ports data that it takes from it. The
    /// same at every call.
    fn ports(&self) -> Vec<Port>;

    /// Begins to get the devices ready.
    fn open(&mut self, now: HostTime);

    /// Begins a transfer. `from_process` holds the input ports, end to end, in order.
    fn begin(&mut self, now: HostTime, from_process: &[f64]);

    /// Begins to leave the devices in a safe state, whatever it was at.
    fn close(&mut self, now: HostTime);

    /// Takes bytes that were read at `now`: any bytes at all, in pieces of any length.
    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]);

    /// It is `now`, which is when [`Driver::poll_timeout`] wanted to be told, or later.
    fn handle_timeout(&mut self, now: HostTime);

    /// When the driver wants to go on even if no byte comes.
    fn poll_timeout(&self) -> Option<HostTime>;

    /// Appends what is to be written next, in one piece, to `bytes`; says whether there was anything.
    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool;

    /// Whether what was begun last is still going on.
    ///
    /// # Errors
    /// [`DriverError`] if the devices cannot be used any longer; the run ends.
    fn poll_transfer(&mut self) -> Result<Transfer, DriverError>;

    /// What the last finished transfer brought: the output ports, end to end, in order.
    fn to_process(&self) -> &[f64];

    /// What can be seen of the driver beside that: its counters. Output ports, the same at every call.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the gauges, end to end, in order.
    fn read_diagnostics(&self, values: &mut [f64]) {
        let _ = values;
    }

    /// Saves everything that the way ahead depends on.
    fn save(&self) -> Snapshot;

    /// Goes back to a saved state.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is not of such a driver.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}

/// How far a transfer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// It goes on.
    Busy,
    /// It is over, and its data are valid.
    Done,
}

/// Devices that a driver can no longer use.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{why}")]
pub struct DriverError {
    /// Why, with what can be done about it.
    pub why: String,
}
