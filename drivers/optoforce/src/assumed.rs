//! Every figure of this crate that no source gives, in one place.

use twinrig_kernel::SimDuration;

/// Force of the OMD-30-FF-1600N at [`NOMINAL_COUNTS`] \[N\]. ASSUMED: each sensor comes with its own.
pub(crate) const NOMINAL_FORCE: f64 = 1600.0;
/// Counts at [`NOMINAL_FORCE`], beyond which an axis is overloaded. ASSUMED.
pub(crate) const NOMINAL_COUNTS: f64 = 6000.0;
/// How often the sensor measures, filters and counts, whatever it sends of that: its fastest speed. ASSUMED.
pub(crate) const MEASURES_EVERY: SimDuration = SimDuration::from_millis(1);
/// How long the driver waits for an acknowledgement, and then for a sample. ASSUMED: twice the slowest speed.
pub(crate) const PATIENCE: SimDuration = SimDuration::from_millis(200);
/// How often it asks before it gives up. ASSUMED.
pub(crate) const ATTEMPTS: u32 = 3;
/// From a configuration's last byte to its acknowledgement's first bit. ASSUMED.
pub(crate) const REACTION: SimDuration = SimDuration::from_micros(50);
