//! Powers of the forces at the rates of the legs.

use nalgebra::Vector3;
use twinrig_legged::{LEGS, Ledger};

use crate::leg_forces::{Constraints, LegForces};
use crate::model::Model;
use crate::rates::LegRates;

/// Powers by their account in the energy balance \[W\].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Powers {
    actuator: f64,
    dissipated: f64,
    impact: f64,
}

impl Powers {
    /// Returns the powers of forces at these rates, of joint friction at the rates
    /// `friction_rates`, and of the forces of the ground on the body, normal and friction.
    pub(crate) fn new(
        model: &Model,
        forces: &[LegForces; LEGS],
        [rates, friction_rates]: [&[LegRates; LEGS]; 2],
        [normal_of_body, friction_of_body]: [f64; 2],
        constraints: &Constraints,
    ) -> Self {
        let mut powers = Self {
            impact: -normal_of_body,
            dissipated: -friction_of_body,
            ..Self::default()
        };
        let mut limit_power = constraints.power - normal_of_body - friction_of_body;
        for (i, leg) in model.legs.iter().enumerate() {
            let (forces, rates) = (&forces[i], &rates[i]);
            let [mut of_drives, mut of_clutches] = [0.0; 2];
            let drives = forces.torques.iter().zip(rates.drive_rates());
            for ((torque, rate), servo) in drives.zip(&model.servos) {
                of_drives += torque * rate;
                if servo.is_some() {
                    of_clutches += torque * rate;
                }
            }
            powers.actuator += of_drives;
            limit_power -= of_clutches;
            for (joint, friction) in leg.friction.iter().enumerate() {
                powers.dissipated +=
                    friction * friction_rates[i].joints[joint] * rates.joints[joint];
            }
            if let Some(axis) = &leg.abduction {
                powers.dissipated += axis.friction * friction_rates[i].abduction * rates.abduction;
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
