use std::cmp::Ordering;

use twinrig_kernel::SimDuration;

use super::SensorModelError;
use crate::Timing;

/// Parameters of a sensor, in the unit of its signal; of a rotation in radians about each axis of
/// the rotated body.
///
/// A sample passes these effects in this order:
///
/// 1. It is taken at the first transfer at or after each multiple of `period`; without a period at
///    each transfer, and whenever its task has newer results between transfers.
/// 2. Each element is added `bias`, its random walk and white noise. A rotation is followed by
///    the small rotation whose vector they are, which keeps its norm.
/// 3. It is limited to `range`.
/// 4. It is rounded to a multiple of `resolution`.
/// 5. It is lost with the probability `drop_out`: the process keeps the one before.
/// 6. It arrives `delay` later, but not before those taken earlier: their order is kept.
///
/// An effect that is absent changes no bit and draws no random number.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorModel {
    /// Period of the samples; none for a sample at every transfer.
    pub period: Option<SimDuration>,
    /// Delay of each sample.
    pub delay: Timing,
    /// Standard deviation of the white noise.
    pub noise: f64,
    /// Constant error.
    pub bias: f64,
    /// Standard deviation of the random walk after one second.
    pub random_walk: f64,
    /// Distance of the values that can be represented; 0 for all values.
    pub resolution: f64,
    /// Least and greatest value.
    pub range: Option<(f64, f64)>,
    /// Probability that a sample is lost.
    pub drop_out: f64,
}

/// A sensor without any effect.
impl Default for SensorModel {
    fn default() -> Self {
        Self {
            period: None,
            delay: Timing::ZERO,
            noise: 0.0,
            bias: 0.0,
            random_walk: 0.0,
            resolution: 0.0,
            range: None,
            drop_out: 0.0,
        }
    }
}

impl SensorModel {
    /// Returns whether values differ from the signal before they are limited and rounded.
    pub(super) fn deviates(&self) -> bool {
        self.bias != 0.0 || self.random_walk > 0.0 || self.noise > 0.0
    }

    /// Returns a limited and rounded value.
    pub(super) fn represent(&self, value: f64) -> f64 {
        let limited = match self.range {
            Some((least, greatest)) => value.clamp(least, greatest),
            None => value,
        };
        if self.resolution > 0.0 {
            (limited / self.resolution).round() * self.resolution
        } else {
            limited
        }
    }

    /// Checks the parameters, of a signal that is a rotation or not.
    pub(crate) fn check(&self, is_rotation: bool) -> Result<(), SensorModelError> {
        let out = |key, range| Err(SensorModelError::OutOfRange { key, range });
        for (key, value) in [
            ("noise", self.noise),
            ("random_walk", self.random_walk),
            ("resolution", self.resolution),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return out(key, "at least 0");
            }
        }
        if !self.bias.is_finite() {
            return out("bias", "a finite number");
        }
        if !(0.0..=1.0).contains(&self.drop_out) {
            return out("drop_out", "from 0 to 1");
        }
        if self.period.is_some_and(SimDuration::is_zero) {
            return out("period", "above 0");
        }
        match self.range {
            Some((least, greatest)) if least.partial_cmp(&greatest) != Some(Ordering::Less) => {
                out("range", "the least value before the greatest")
            }
            Some(_) if is_rotation => Err(SensorModelError::OfRotation { key: "range" }),
            _ if is_rotation && self.resolution > 0.0 => {
                Err(SensorModelError::OfRotation { key: "resolution" })
            }
            _ => Ok(()),
        }
    }
}
