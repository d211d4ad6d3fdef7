use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError};
use twinrig_wire::Diagnostics;

/// A sample in units, at its own time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TactileSample {
    /// Time of the sample by the clock of the host, mapped from the board's stamp: strictly
    /// increasing from sample to sample.
    pub at: HostTime,
    /// Time at which the driver received the sample.
    pub arrived: HostTime,
    /// Stamp of the board's clock \[µs\], without its wrap; begins again when the board restarts.
    pub stamp_us: u64,
    /// Voltages of the piezoresistive and the piezoelectric amplifier \[V\].
    pub volts: [f64; 2],
    /// Force of the reference cell \[N\].
    pub reference: f64,
    /// Channels out of range: piezoresistive, piezoelectric, reference.
    pub saturated: [bool; 3],
}

/// Processing of every sample on the host, before the process reads: a filter.
///
/// A stage is mounted in the driver by [`crate::TactileDriver::with_stage`], and runs unchanged
/// with emulated and with real boards. It has neither a clock nor input and output: its results
/// depend on its calls only.
pub trait Stage: Send {
    /// Returns the ports, constant over the life of the stage: outputs are read by the process
    /// ([`Stage::outputs`]), inputs are written by it ([`Stage::begin_transfer`]).
    fn ports(&self) -> Vec<Port>;

    /// Processes a sample. Every sample received is passed once, in order of time; lost ones are
    /// missing.
    fn handle_sample(&mut self, sample: &TactileSample);

    /// Handles the beginning of a transfer at `now`. `from_process` holds the input ports, end to
    /// end, in order. All samples received by now have been passed. A sample may still complete the
    /// transfer, if the driver waits for a fresh one.
    fn begin_transfer(&mut self, now: HostTime, from_process: &[f64]) {
        let _ = (now, from_process);
    }

    /// Returns the output ports, end to end, in order.
    fn outputs(&self) -> &[f64];

    /// Reports the diagnostics.
    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        let _ = diagnostics;
    }

    /// Saves all state that affects later behaviour.
    fn save(&self) -> Snapshot;

    /// Restores a saved state, bit for bit.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot belongs to another kind of stage.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}
