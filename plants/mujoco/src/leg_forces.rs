//! The forces that MuJoCo found, as a leg feels them.

use serde::{Deserialize, Serialize};
use twinrig_legged::{Fitted, LEGS};

use crate::addresses::Addresses;
use crate::drives::{self, Inputs};
use crate::engine::Engine;
use crate::model::Model;
use crate::rates::{Held, LegRates};

/// What acts on a leg, at an instant or in the mean of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegForces {
    /// Torques of hip and knee drive \[N·m\].
    pub(crate) torques: [f64; 2],
    /// Of the cable \[N\].
    pub(crate) tension: f64,
    /// Of the ground on the foot, world axes: along the contact's normal, and along the ground \[N\].
    pub(crate) normal: [f64; 3],
    pub(crate) along: [f64; 3],
}

impl LegForces {
    /// Adds so much of another.
    pub(crate) fn add(&mut self, weight: f64, other: &Self) {
        self.tension += weight * other.tension;
        for (sum, more) in self.torques.iter_mut().zip(other.torques) {
            *sum += weight * more;
        }
        for axis in 0..3 {
            self.normal[axis] += weight * other.normal[axis];
            self.along[axis] += weight * other.along[axis];
        }
    }
}

/// The forces on all legs, where the drives turn at these rates.
pub(crate) fn feel(
    engine: &Engine,
    model: &Model,
    at: &Addresses,
    inputs: &Inputs,
    rates: &[LegRates; LEGS],
) -> [LegForces; LEGS] {
    let mut all = [LegForces::default(); LEGS];
    for (leg, at) in at.legs.iter().enumerate() {
        let forces = &mut all[leg];
        let held = engine.data().qfrc_constraint();
        let mut clutch = 0.0;
        if let Some(flywheels) = &at.flywheels {
            forces.torques = drives::transmitted(engine, flywheels);
            clutch = forces.torques[1] / model.legs[leg].pulley_radius;
        } else if let Some(Fitted::Motors(motors)) = &model.drives {
            for (i, motor) in motors.both().into_iter().enumerate() {
                let [voltage, bridge] = [inputs[leg][2 * i], inputs[leg][2 * i + 1]];
                let rate = rates[leg].driven()[i];
                forces.torques[i] = motor.line(voltage, bridge).torque_at(rate);
            }
        }
        if let (_, Some(pulley)) = drives::driven(at) {
            forces.tension = clutch - held[pulley];
        }
        if let Some(foot) = at.foot {
            [forces.normal, forces.along] = pressed(engine, foot);
        }
    }
    all
}

/// What all constraints do at these velocities, but for the clutches on their flywheels.
pub(crate) fn held(engine: &Engine, at: &Addresses, qvel: impl Iterator<Item = f64>) -> Held {
    let data = engine.data();
    let wheels = at.legs.iter().filter_map(|leg| leg.flywheels);
    let is_wheel = |dof: usize| wheels.clone().flatten().any(|[_, wheel]| wheel == dof);
    let all = data.qfrc_constraint().iter().zip(qvel).enumerate();
    let leg_forces = all.filter(|(dof, _)| !is_wheel(*dof));
    Held {
        power: leg_forces.map(|(_, (force, rate))| force * rate).sum(),
        clutches: wheels.clone().next().is_some(),
        limits: data.nl() > 0,
    }
}

/// Forces of the ground on a foot: along the normals of its contacts, and across them \[N\].
fn pressed(engine: &Engine, foot: usize) -> [[f64; 3]; 2] {
    let mut leg_forces = [[0.0; 3]; 2];
    for (id, contact) in engine.data().contact().iter().enumerate() {
        let of = |geom: i32| usize::try_from(geom).is_ok_and(|geom| geom == foot);
        let [first, second] = contact.geom.map(of);
        if !(first || second) {
            continue;
        }
        // A contact's force is that on its second body.
        let sign = if second { 1.0 } else { -1.0 };
        let force = engine.data().contact_force(id);
        let [normal, first, second] =
            [0, 1, 2].map(|row| contact.frame[3 * row..][..3].iter().copied());
        let [pressing, along, across] = [0, 1, 2].map(|row| sign * force[row]);
        for (sum, n) in leg_forces[0].iter_mut().zip(normal) {
            *sum += pressing * n;
        }
        for (sum, (a, b)) in leg_forces[1].iter_mut().zip(first.zip(second)) {
            *sum += along * a + across * b;
        }
    }
    leg_forces
}
