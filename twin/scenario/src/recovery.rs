//! Claims about the recovery from a disturbance.

use twinrig_kernel::{SimDuration, SimTime};

/// Disturbance of a run, and the time within which quantities recover from it.
///
/// A quantity has recovered when it stays, to the end of the expectation's window, within the range
/// that it had in the window before the disturbance, widened by a tolerance on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recovery {
    /// Start of the disturbance.
    pub start: SimTime,
    /// End of the disturbance, from which the recovery counts.
    pub end: SimTime,
    /// Greatest time of the recovery.
    pub within: SimDuration,
}

/// Quantity of the trunk that recovers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrunkQuantity {
    /// \[rad\]
    Roll,
    /// \[rad\]
    Pitch,
    /// Whole turns included \[rad\].
    Yaw,
    /// Height of the centre of mass \[m\].
    Height,
    /// Horizontal speed along the heading, mean of one observation period \[m/s\].
    Speed,
}

impl TrunkQuantity {
    /// Returns the name in verdicts.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            TrunkQuantity::Roll => "roll",
            TrunkQuantity::Pitch => "pitch",
            TrunkQuantity::Yaw => "yaw",
            TrunkQuantity::Height => "height",
            TrunkQuantity::Speed => "speed",
        }
    }
}
