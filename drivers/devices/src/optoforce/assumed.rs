//! Parameters for which no source exists, each marked ASSUMED.

use twinrig_kernel::SimDuration;

/// Force of the OMD-30-FF-1600N at [`NOMINAL_COUNTS`] \[N\]. ASSUMED: every sensor has an
/// individual calibration.
pub(crate) const NOMINAL_FORCE: f64 = 1600.0;
/// Counts at [`NOMINAL_FORCE`], beyond which an axis is overloaded. ASSUMED.
pub(crate) const NOMINAL_COUNTS: i16 = 6000;
/// Period of measuring and filtering, independent of the output rate: its maximum rate. ASSUMED.
pub(crate) const SAMPLE_PERIOD: SimDuration = SimDuration::from_millis(1);
/// Time-out of an acknowledgement, and then of a sample. ASSUMED: twice the period of the lowest
/// rate.
pub(crate) const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(200);
/// Time from a configuration's last byte to its acknowledgement's first bit. ASSUMED.
pub(crate) const REACTION: SimDuration = SimDuration::from_micros(50);
