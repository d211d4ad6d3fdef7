use twinrig_kernel::SimDuration;

/// Time limits of a driver; exceeding one ends the run with an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Opening of the devices, including calibration, which moves motors.
    pub open: SimDuration,
    /// One transfer.
    pub transfer: SimDuration,
    /// Transition of the devices into a safe state.
    pub close: SimDuration,
}

/// 30 s, 1 s and 2 s.
impl Default for Limits {
    fn default() -> Self {
        Self {
            open: SimDuration::from_secs(30),
            transfer: SimDuration::from_secs(1),
            close: SimDuration::from_secs(2),
        }
    }
}
