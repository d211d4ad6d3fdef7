//! Rates at which forces do work.

use twinrig_legged::LEGS;

use crate::frame::{LegFrame, TrunkFrame};
use crate::inputs::DRIVES;
use crate::model::{LegModel, Model};
use crate::options::{Coordinates, Integrator};

/// Rates of a leg: hip, knee, ankle, pulley and abduction \[rad/s\], foot in the world \[m/s\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LegRates {
    pub(crate) joints: [f64; 3],
    pulley: f64,
    pub(crate) abduction: f64,
    pub(crate) foot: [f64; 3],
}

impl LegRates {
    fn new(leg: &LegModel, trunk: &TrunkFrame, frame: &LegFrame) -> Self {
        let [place, speed] = frame.foot(leg);
        let foot = trunk.point_velocity(&place, &speed);
        let [first, second, third] = frame.bars.map(|bar| bar.rate);
        Self {
            joints: [first, second - first, third - second],
            pulley: frame.pulley_rate,
            abduction: frame.carrier.rate,
            foot: foot.into(),
        }
    }

    /// Returns the rates of the drives.
    pub(crate) fn drive_rates(&self) -> [f64; DRIVES] {
        [self.joints[0], self.pulley, self.abduction]
    }

    fn mean_with(&self, other: &Self) -> Self {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let three =
            |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| mean(a[i], b[i])) };
        Self {
            joints: three(&self.joints, &other.joints),
            pulley: mean(self.pulley, other.pulley),
            abduction: mean(self.abduction, other.abduction),
            foot: three(&self.foot, &other.foot),
        }
    }
}

/// Returns the rates at which joint friction acts in a step: MuJoCo evaluates that of joints, and
/// with implicit methods all friction, at the end of the step.
pub(crate) fn friction_rates(
    model: &Model,
    before: &[LegRates; LEGS],
    after: &[LegRates; LEGS],
) -> [LegRates; LEGS] {
    let mut friction_rates = *after;
    if (model.coordinates, model.numerics.integrator) == (Coordinates::Maximal, Integrator::Euler) {
        // In this case friction of knee and ankle is that of tendons, which is explicit.
        for (rates, before) in friction_rates.iter_mut().zip(before) {
            rates.joints[1..].copy_from_slice(&before.joints[1..]);
        }
    }
    friction_rates
}

/// Returns the rates of all legs.
pub(crate) fn of_all(
    model: &Model,
    trunk: &TrunkFrame,
    legs: &[Option<LegFrame>; LEGS],
) -> [LegRates; LEGS] {
    let mut all = [LegRates::default(); LEGS];
    let frames = model.legs.iter().zip(legs.iter().flatten());
    for (rates, (leg, frame)) in all.iter_mut().zip(frames) {
        *rates = LegRates::new(leg, trunk, frame);
    }
    all
}

/// Returns the means of two sets of rates.
pub(crate) fn mean(one: &[LegRates; LEGS], other: &[LegRates; LEGS]) -> [LegRates; LEGS] {
    std::array::from_fn(|leg| one[leg].mean_with(&other[leg]))
}
