use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalDuration, Snapshot, SnapshotError};

use crate::registers::Registers;
use crate::table::ServoModel;

/// Measurements of a servo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoMeasurements {
    /// Angle of the shaft \[rad\].
    pub angle: f64,
    /// Its rate \[rad/s\].
    pub rate: f64,
    /// Current of the motor \[A\].
    pub current: f64,
    /// Voltage of the supply \[V\].
    pub voltage: f64,
    /// Temperature \[°C\].
    pub temperature: f64,
}

/// Command of the bridge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum BridgeCommand {
    /// Open: the motor has no current.
    Open,
    /// Duty cycle, −1 to 1.
    Duty(f64),
}

/// Inner loops of a servo: they read goals and limits in the registers, and write the measurements.
pub trait ServoFirmware: Send {
    /// Returns the period of the loops, by the clock of the servo.
    fn period(&self) -> LocalDuration;

    /// A period of the loops, after so many `instructions` on the bus; returns the command of the
    /// bridge.
    fn step(
        &mut self,
        registers: &mut Registers,
        measured: &ServoMeasurements,
        instructions: u64,
    ) -> BridgeCommand;

    /// Forgets the turns: the position is within one turn.
    fn clear_turns(&mut self) {}

    /// Saves the state.
    fn save(&self) -> Snapshot;

    /// Restores a saved state.
    ///
    /// # Errors
    /// [`SnapshotError`] if it is of another firmware.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError>;
}

/// Kind of servo: what it has on the bus, and its firmware.
#[derive(Debug)]
pub struct ServoKind {
    /// Control table and properties of its side of the bus.
    pub model: &'static ServoModel,
    /// Creates the firmware at power-on.
    pub firmware: fn() -> Box<dyn ServoFirmware>,
    /// Nominal voltage of the supply \[V\] (manual, "Input Voltage").
    pub voltage: f64,
}
