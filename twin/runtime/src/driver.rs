use thiserror::Error;
use twinrig_kernel::{HostTime, Port, SimDuration, Snapshot, SnapshotError};

use crate::BusHealth;

/// Master side of a protocol, sans-IO: bytes and times in, bytes and wake-up times out. The same
/// driver is used with a modelled [`crate::Wire`] in virtual time and with a real [`crate::Device`]
/// in real time, and cannot distinguish the two.
///
/// An executor calls [`Driver::open`] once, then [`Driver::begin`] for each transfer, and
/// [`Driver::close`] once. After each of these, after bytes have arrived ([`Driver::handle_bytes`])
/// and after the time of [`Driver::poll_timeout`] is reached ([`Driver::handle_timeout`]), it
///
/// 1. writes the bytes of [`Driver::poll_transmit`] until that returns false;
/// 2. calls [`Driver::is_busy`] to learn whether opening, the transfer or closing has ended.
pub trait Driver: Send {
    /// Returns the name of the bus in the scenario, used in messages, diagnostics and recordings.
    fn name(&self) -> &str;

    /// Returns the ports: outputs are provided to the process, inputs are read from it. Constant
    /// over the life of the driver.
    fn ports(&self) -> Vec<Port>;

    /// Begins to prepare the devices.
    fn open(&mut self, now: HostTime);

    /// Begins a transfer. `from_process` contains the input ports, concatenated in order.
    fn begin(&mut self, now: HostTime, from_process: &[f64]);

    /// Begins to put the devices into a safe state, from any phase.
    fn close(&mut self, now: HostTime);

    /// Processes bytes read at `now`: arbitrary bytes, in pieces of any length.
    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]);

    /// Handles the timeout of [`Driver::poll_timeout`], at that time or later.
    fn handle_timeout(&mut self, now: HostTime);

    /// Returns the time of the next timeout, which is due even if no byte arrives.
    fn poll_timeout(&self) -> Option<HostTime>;

    /// Appends the next bytes to be written, in one piece, to `bytes`; returns whether there were
    /// any.
    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool;

    /// Returns whether the phase begun last (opening, transfer, closing) is still in progress. A
    /// transfer that has ended provides valid results.
    ///
    /// # Errors
    /// [`DriverError`] if the devices cannot be used any longer; the run ends.
    fn is_busy(&self) -> Result<bool, DriverError>;

    /// Returns the results of the last finished transfer: the output ports, concatenated in order.
    fn to_process(&self) -> &[f64];

    /// Returns the ports of the diagnostics (counters), all of them outputs. Constant over the life
    /// of the driver.
    fn diagnostics(&self) -> Vec<Port> {
        Vec::new()
    }

    /// Writes the diagnostics, concatenated in order.
    fn read_diagnostics(&self, values: &mut [f64]) {
        let _ = values;
    }

    /// Returns the nominal duration of a transfer, as [`crate::IoTask::period`].
    fn period(&self) -> Option<SimDuration> {
        None
    }

    /// Returns the traffic up to `now`; none where the driver counts nothing.
    fn bus_health(&self, now: HostTime) -> Option<BusHealth> {
        let _ = now;
        None
    }

    /// Saves all state that affects later behaviour.
    fn save(&self) -> Snapshot;

    /// Restores a saved state.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot belongs to another kind of driver.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}

/// Failure of a driver's devices: they can no longer be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{why}")]
pub struct DriverError {
    /// The reason, with a remedy where there is one.
    pub why: String,
}
