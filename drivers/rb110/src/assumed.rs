//! Every figure of this crate that no source gives, in one place.

use twinrig_kernel::SimDuration;

/// A byte between computer and board: 1 Mbit/s. ASSUMED.
pub(crate) const BYTE_TIME: SimDuration = SimDuration::from_micros(10);
/// From a request's last byte to the answer's first bit: all channels are converted meanwhile. ASSUMED.
pub(crate) const REACTION: SimDuration = SimDuration::from_micros(20);
/// The reference of the analog inputs \[V\]. ASSUMED.
pub(crate) const REFERENCE: f64 = 2.5;
/// How long the driver waits for the first answer. ASSUMED.
pub(crate) const PATIENCE: SimDuration = SimDuration::from_millis(100);
/// How often it asks before it gives up. ASSUMED.
pub(crate) const ATTEMPTS: u32 = 3;
/// A radian in ticks of Oncilla's servos: 90° a millisecond, as with most servos for models. ASSUMED.
pub(crate) const ONCILLA_TICKS_PER_RADIAN: f64 = 50_000.0 / std::f64::consts::FRAC_PI_2;
/// A radian in ticks of Kondo's servos: half a turn from 700 to 2300 µs. ASSUMED.
pub(crate) const KONDO_TICKS_PER_RADIAN: f64 = 80_000.0 / std::f64::consts::PI;
