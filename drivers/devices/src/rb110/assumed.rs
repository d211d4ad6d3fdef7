//! Parameters for which no source exists, each marked ASSUMED.

use twinrig_kernel::SimDuration;

/// Time of a byte between computer and board: 1 Mbit/s. ASSUMED.
pub(crate) const BYTE_TIME: SimDuration = SimDuration::from_micros(10);
/// Time from a request's last byte to the answer's first bit, during which all channels are
/// converted. ASSUMED.
pub(crate) const REACTION: SimDuration = SimDuration::from_micros(20);
/// Reference voltage of the analog inputs \[V\]. ASSUMED.
pub(crate) const REFERENCE: f64 = 2.5;
/// Time-out of an answer when opening or closing. ASSUMED.
pub(crate) const ANSWER_TIMEOUT: SimDuration = SimDuration::from_millis(100);
/// Ticks per radian of Oncilla's servos: 90° per millisecond, as for most model servos. ASSUMED.
pub(crate) const ONCILLA_TICKS_PER_RADIAN: f64 = 50_000.0 / std::f64::consts::FRAC_PI_2;
/// Ticks per radian of Kondo's servos: half a turn from 700 to 2300 µs. ASSUMED.
pub(crate) const KONDO_TICKS_PER_RADIAN: f64 = 80_000.0 / std::f64::consts::PI;
