//! Drives of a leg and their inputs.

use serde::{Deserialize, Serialize};
use twinrig_legged::LEGS;

/// Drives of a leg, in this order.
pub(crate) const DRIVE_NAMES: [&str; DRIVES] = ["hip", "knee", "abduction"];
pub(crate) const DRIVES: usize = 3;

/// Index of the drive of abduction.
pub(crate) const ABDUCTION: usize = 2;

/// Inputs of a leg's drives, as of the ports.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegInputs {
    /// Commands of hip and knee \[rad\], or voltage \[V\] and bridge of both.
    pub(crate) drives: [f64; 4],
    /// Command of abduction \[rad\], or the two inputs of its motor.
    pub(crate) abduction: [f64; 2],
}

impl LegInputs {
    /// Returns the commands of servos of hip, knee and abduction \[rad\].
    pub(crate) fn commands(&self) -> [f64; DRIVES] {
        let [hip, knee, ..] = self.drives;
        [hip, knee, self.abduction[0]]
    }

    /// Returns both inputs of the motor of a drive: voltage \[V\] and bridge, or a torque–rate
    /// line.
    pub(crate) fn of_motor(&self, drive: usize) -> [f64; 2] {
        match drive {
            ABDUCTION => self.abduction,
            _ => [self.drives[2 * drive], self.drives[2 * drive + 1]],
        }
    }
}

/// Inputs of all legs.
pub(crate) type Inputs = [LegInputs; LEGS];
