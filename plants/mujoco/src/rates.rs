//! How fast everything moves that forces work on, and what power they have.

use nalgebra::Vector3;
use twinrig_legged::{LEGS, Ledger};

use crate::frame::{LegFrame, TrunkFrame, spatial};
use crate::leg_forces::LegForces;
use crate::model::{LegModel, Model};
use crate::options::{Coordinates, Integrator};

/// Of a leg: hip, knee, ankle and pulley \[rad/s\], its foot in the world \[m/s\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LegRates {
    joints: [f64; 3],
    pulley: f64,
    foot: [f64; 3],
}

impl LegRates {
    fn new(leg: &LegModel, trunk: &TrunkFrame, frame: &LegFrame) -> Self {
        let [place, speed] = frame.foot(leg);
        let foot = trunk.carried(&spatial(place, leg.hip[1]), &spatial(speed, 0.0));
        let [first, second, third] = frame.bars.map(|bar| bar.rate);
        Self {
            joints: [first, second - first, third - second],
            pulley: frame.pulley_rate,
            foot: foot.into(),
        }
    }

    /// What hip and knee drive turn.
    pub(crate) fn driven(&self) -> [f64; 2] {
        [self.joints[0], self.pulley]
    }

    fn between(&self, other: &Self) -> Self {
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

/// The rates at which friction of the joints acts in a step: MuJoCo takes that of joints, and with implicit methods all, at
/// the step's end.
pub(crate) fn rubbing(
    model: &Model,
    before: &[LegRates; LEGS],
    after: &[LegRates; LEGS],
) -> [LegRates; LEGS] {
    let mut rubbing = *after;
    if (model.coordinates, model.numerics.integrator) == (Coordinates::Maximal, Integrator::Euler) {
        // There, friction of knee and ankle is that of tendons.
        for (rates, before) in rubbing.iter_mut().zip(before) {
            rates.joints[1..].copy_from_slice(&before.joints[1..]);
        }
    }
    rubbing
}

/// The rates of all legs.
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

/// What they are on the way from one to the other.
pub(crate) fn mean(one: &[LegRates; LEGS], other: &[LegRates; LEGS]) -> [LegRates; LEGS] {
    std::array::from_fn(|leg| one[leg].between(&other[leg]))
}

/// What MuJoCo holds by constraints.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    /// Power of all of them \[W\].
    pub(crate) power: f64,
    /// Whether clutches are among them.
    pub(crate) clutches: bool,
    /// Whether stops or cables are. Else what ground and clutches have no part in is the pins': they should do no work, and what
    /// they do is an error of the engine, for the residual to show.
    pub(crate) limits: bool,
}

/// Where power goes \[W\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Powers {
    actuator: f64,
    dissipated: f64,
    impact: f64,
}

impl Powers {
    /// Of forces at these rates, and of the friction that joints have at the rates `rubbing`.
    pub(crate) fn new(
        model: &Model,
        forces: &[LegForces; LEGS],
        [rates, rubbing]: [&[LegRates; LEGS]; 2],
        held: &Held,
    ) -> Self {
        let mut powers = Self::default();
        let mut stops = held.power;
        for (i, leg) in model.legs.iter().enumerate() {
            let (forces, rates) = (&forces[i], &rates[i]);
            let [hip, knee] = rates.driven();
            let driven = forces.torques[0] * hip + forces.torques[1] * knee;
            powers.actuator += driven;
            if held.clutches {
                stops -= driven;
            }
            for (joint, friction) in leg.friction.iter().enumerate() {
                powers.dissipated += friction * rubbing[i].joints[joint] * rates.joints[joint];
            }
            let along = |force: [f64; 3]| Vector3::from(force).dot(&Vector3::from(rates.foot));
            let (pressed, rubbed) = (along(forces.normal), along(forces.along));
            powers.impact -= pressed;
            powers.dissipated -= rubbed;
            stops -= pressed + rubbed;
        }
        if held.limits {
            powers.impact -= stops;
        }
        powers
    }

    /// Enters what flows in so many seconds.
    pub(crate) fn enter(&self, seconds: f64, ledger: &mut Ledger) {
        ledger.actuator += self.actuator * seconds;
        ledger.dissipated += self.dissipated * seconds;
        ledger.impact += self.impact * seconds;
    }
}
