//! Serial servos: the controller in their firmware ([`Firmware`]), currents and torques of the
//! motor ([`Winding`]), and the servo as the drive of a joint in any plant ([`SerialDrive`]). The
//! bench of one servo is the crate `twinrig-servo`.

mod drive;
mod firmware;
mod winding;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

pub use drive::{SerialDrive, SerialDriveState};
pub use firmware::{Firmware, FirmwareState, ServoCommand};
pub use winding::{Electric, Winding};

/// Command of the bridge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Bridge {
    /// Open: the motor has no current.
    Open,
    /// Duty cycle, −1 to 1.
    Duty(f64),
}

/// Returns a duration that the ranges of the parameters admit.
pub fn duration(seconds: f64) -> SimDuration {
    SimDuration::try_from_secs_f64(seconds).unwrap_or(SimDuration::ZERO)
}
