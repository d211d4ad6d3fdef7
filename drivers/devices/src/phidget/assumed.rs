//! Parameters for which no source exists, each marked ASSUMED.

use twinrig_kernel::SimDuration;

/// Polling interval of the USB interrupt endpoint. ASSUMED.
pub(crate) const POLL: SimDuration = SimDuration::from_millis(8);
/// Time of a byte over full-speed USB: 12 Mbit/s. ASSUMED.
pub(crate) const BYTE_TIME: SimDuration = SimDuration::from_nanos(667);
/// Time-out of the acceptance of a set-up, and then, in addition to the data interval, of a report.
/// ASSUMED.
pub(crate) const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(200);
