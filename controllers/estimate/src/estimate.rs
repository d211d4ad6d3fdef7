//! Estimate of the load at one time.

use crate::kalman::Innovation;
use crate::measurement::Channel;

/// Estimated load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Time of the estimate \[ns\]; `None` before the first measurement.
    pub at_ns: Option<u64>,
    /// Force \[N\].
    pub force: f64,
    /// Its standard deviation \[N\].
    pub deviation: f64,
    /// Rate of the force \[N/s\].
    pub rate: f64,
    /// Its standard deviation \[N/s\].
    pub rate_deviation: f64,
    /// Bias of the piezoelectric voltage \[V\].
    pub bias: f64,
    /// Sum of ν²/S over the measurements of the newest time stamp, chi-squared with `nis_count`
    /// degrees of freedom if the filter is consistent.
    pub nis: f64,
    /// Number of these measurements.
    pub nis_count: u32,
    /// Newest innovation of each [`Channel`].
    pub innovations: [Option<Innovation>; Channel::COUNT],
    /// Number of piezoresistive updates linearised at the measured voltage (see
    /// [`Settings::recovery`](crate::Settings::recovery)).
    pub recoveries: u64,
}
