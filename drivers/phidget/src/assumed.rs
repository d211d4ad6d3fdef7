//! Every figure of this crate that no source gives, in one place.

use twinrig_kernel::SimDuration;

/// How often USB asks a board whether it has something to report: an interrupt transfer. ASSUMED.
pub(crate) const POLL: SimDuration = SimDuration::from_millis(8);
/// A byte over full-speed USB: 12 Mbit/s. ASSUMED.
pub(crate) const BYTE_TIME: SimDuration = SimDuration::from_nanos(667);
/// How long the driver waits for a board to accept its set-up, and then, beyond a data interval, for a report. ASSUMED.
pub(crate) const PATIENCE: SimDuration = SimDuration::from_millis(200);
/// How often it asks before it gives up. ASSUMED.
pub(crate) const ATTEMPTS: u32 = 3;
