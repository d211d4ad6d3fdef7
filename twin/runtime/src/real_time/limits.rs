use twinrig_kernel::SimDuration;

/// How long a driver may take before the run ends with an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// For opening its devices: calibration moves motors.
    pub open: SimDuration,
    /// For one transfer.
    pub transfer: SimDuration,
    /// For leaving its devices in a safe state.
    pub close: SimDuration,
}

/// Half a minute, a second, and two.
impl Default for Limits {
    fn default() -> Self {
        Self {
            open: SimDuration::from_secs(30),
            transfer: SimDuration::from_secs(1),
            close: SimDuration::from_secs(2),
        }
    }
}
