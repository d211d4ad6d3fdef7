//! Instants of a run as numbers.

use twinrig_kernel::SimTime;
use twinrig_record::EPOCH;

/// Converts nanoseconds to the nearest number of seconds, which has the shortest decimal form:
/// 0.498, not 0.49800000000000005.
pub fn seconds(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}

/// Returns an instant of a run as its recording has it \[s\].
pub fn recording_s(at: SimTime) -> f64 {
    seconds(at.as_nanos().saturating_add(EPOCH.as_nanos()))
}
