//! Accepted values of servos that a hand can hold, but not what a slip of a unit makes of them.

use twinrig_document::Range;
use twinrig_document::declaration::{Defaulted, Type};

pub(crate) const VOLTAGE: Range = Range::positive_to(100.0);
pub(crate) const DIODES: Range = Range::between(0.0, 10.0);
pub(crate) const SERIES_RESISTANCE: Range = Range::between(0.0, 100.0);
pub(crate) const RESISTANCE: Range = Range::between(1e-3, 1e4);
pub(crate) const TORQUE_CONSTANT: Range = Range::between(1e-4, 100.0);
pub(crate) const INERTIA: Range = Range::between(1e-8, 10.0);
pub(crate) const CURRENT: Range = Range::positive_to(1e3);
/// With the upper end iron does not saturate.
pub(crate) const SATURATION: Range = Range::positive_to(1e9);
pub(crate) const HEAT_CAPACITY: Range = Range::between(1e-4, 1e6);
pub(crate) const COOLING: Range = Range::between(1e-2, 1e6);
pub(crate) const TORQUE: Range = Range::between(0.0, 100.0);
pub(crate) const DAMPING: Range = Range::between(0.0, 100.0);
pub(crate) const RATE: Range = Range::between(1e-4, 1e3);
pub(crate) const EXPONENT: Range = Range::between(0.1, 10.0);
/// Shares of a torque that are lost; a share of the transmitted torque below one keeps the
/// equation of motion solvable.
pub(crate) const SHARE: Range = Range::between(0.0, 10.0);
pub(crate) const DRIVEN_SHARE: Range = Range::between(0.0, 0.95);
pub(crate) const SQUARE: Range = Range::between(0.0, 100.0);
pub(crate) const BACKLASH: Range = Range::between(0.0, 0.5);
pub(crate) const GAIN: Range = Range::between(0.0, 1e5);
pub(crate) const DUTY: Range = Range::positive_to(1.0);
pub(crate) const STARTING_DUTY: Range = Range::between(0.0, 1.0);
pub(crate) const DEAD_ZONE: Range = Range::between(0.0, 1e4);
pub(crate) const COUNTS: std::ops::RangeInclusive<u64> = 1..=1 << 24;
pub(crate) const PERIOD: Range = Range::between(1e-4, 0.05);
pub(crate) const DELAY: Range = Range::between(0.0, 0.1);
pub(crate) const SPEED: Range = Range::positive_to(1e3);
pub(crate) const ACCELERATION: Range = Range::positive_to(1e6);

/// A quantity that is left out where it is zero.
pub(crate) const fn zero(of: Type<f64>) -> Defaulted<f64> {
    Defaulted(of, 0.0, "0")
}
