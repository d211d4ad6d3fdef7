//! Rates at which forces do work, and their powers.

use nalgebra::Vector3;
use twinrig_legged::{LEGS, Ledger};

use crate::frame::{LegFrame, TrunkFrame, spatial};
use crate::leg_forces::LegForces;
use crate::model::{LegModel, Model};
use crate::options::{Coordinates, Integrator};

/// Rates of a leg: hip, knee, ankle and pulley \[rad/s\], foot in the world \[m/s\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LegRates {
    joints: [f64; 3],
    pulley: f64,
    foot: [f64; 3],
}

impl LegRates {
    fn new(leg: &LegModel, trunk: &TrunkFrame, frame: &LegFrame) -> Self {
        let [place, speed] = frame.foot(leg);
        let foot = trunk.point_velocity(&spatial(place, leg.hip[1]), &spatial(speed, 0.0));
        let [first, second, third] = frame.bars.map(|bar| bar.rate);
        Self {
            joints: [first, second - first, third - second],
            pulley: frame.pulley_rate,
            foot: foot.into(),
        }
    }

    /// Returns the rates of hip and knee drive.
    pub(crate) fn drive_rates(&self) -> [f64; 2] {
        [self.joints[0], self.pulley]
    }

    fn mean_with(&self, other: &Self) -> Self {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let three =
            |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| mean(a[i], b[i])) };
        Self {
            joints: three(&self.joints, &other.joints),
            pulley: mean(self.pulley, other.pulley),
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

/// Constraints of the robot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constraints {
    /// Power of all constraints \[W\].
    pub(crate) power: f64,
    /// Whether these include clutches.
    pub(crate) clutches: bool,
    /// Whether these include stops or cables. Otherwise the power without that of ground and
    /// clutches is the pins'. Pins should do no work; their power is an error of the engine and
    /// remains in the residual.
    pub(crate) limits: bool,
}

/// Powers by their account in the energy balance \[W\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Powers {
    actuator: f64,
    dissipated: f64,
    impact: f64,
}

impl Powers {
    /// Returns the powers of forces at these rates, and of joint friction at the rates
    /// `friction_rates`.
    pub(crate) fn new(
        model: &Model,
        forces: &[LegForces; LEGS],
        [rates, friction_rates]: [&[LegRates; LEGS]; 2],
        constraints: &Constraints,
    ) -> Self {
        let mut powers = Self::default();
        let mut limit_power = constraints.power;
        for (i, leg) in model.legs.iter().enumerate() {
            let (forces, rates) = (&forces[i], &rates[i]);
            let [hip, knee] = rates.drive_rates();
            let drive_power = forces.torques[0] * hip + forces.torques[1] * knee;
            powers.actuator += drive_power;
            if constraints.clutches {
                limit_power -= drive_power;
            }
            for (joint, friction) in leg.friction.iter().enumerate() {
                powers.dissipated +=
                    friction * friction_rates[i].joints[joint] * rates.joints[joint];
            }
            let along = |force: [f64; 3]| Vector3::from(force).dot(&Vector3::from(rates.foot));
            let (normal_power, friction_power) = (along(forces.normal), along(forces.along));
            powers.impact -= normal_power;
            powers.dissipated -= friction_power;
            limit_power -= normal_power + friction_power;
        }
        if constraints.limits {
            powers.impact -= limit_power;
        }
        powers
    }

    /// Adds the work over an interval to the energy balance.
    pub(crate) fn add_work(&self, seconds: f64, ledger: &mut Ledger) {
        ledger.actuator += self.actuator * seconds;
        ledger.dissipated += self.dissipated * seconds;
        ledger.impact += self.impact * seconds;
    }
}
