//! Forces on the legs, from MuJoCo's solution.

use serde::{Deserialize, Serialize};
use twinrig_legged::LEGS;

use crate::addresses::Addresses;
use crate::drives;
use crate::engine::Engine;
use crate::inputs::{DRIVES, Inputs};
use crate::model::Model;
use crate::rates::LegRates;

/// Forces on a leg, at an instant or as mean of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegForces {
    /// Torques of the drives of hip, knee and abduction \[N·m\].
    pub(crate) torques: [f64; DRIVES],
    /// Tension of the cable \[N\].
    pub(crate) tension: f64,
    /// Forces of the ground on the foot, world axes: along the contact's normal, and tangential
    /// \[N\].
    pub(crate) normal: [f64; 3],
    pub(crate) along: [f64; 3],
}

impl LegForces {
    /// Adds another's forces times a weight.
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

/// Constraints of the robot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constraints {
    /// Power of all constraints \[W\].
    pub(crate) power: f64,
    /// Whether these include stops or cables. Otherwise the power without that of ground and
    /// clutches is the pins'. Pins should do no work; their power is an error of the engine and
    /// remains in the residual.
    pub(crate) limits: bool,
}

/// Returns the forces on all legs, with the drives at these rates.
pub(crate) fn forces_on_legs(
    engine: &Engine,
    model: &Model,
    at: &Addresses,
    inputs: &Inputs,
    rates: &[LegRates; LEGS],
) -> [LegForces; LEGS] {
    let mut all = [LegForces::default(); LEGS];
    for (leg, at) in at.legs.iter().enumerate() {
        let forces = &mut all[leg];
        let constraint_forces = engine.data().qfrc_constraint();
        for (torque, clutch) in forces.torques.iter_mut().zip(&at.clutches) {
            if let Some(clutch) = clutch {
                *torque = drives::clutch_torque(engine, clutch);
            }
        }
        let clutch = forces.torques[1] / model.legs[leg].pulley_radius;
        for (i, motor) in model.motors().into_iter().enumerate() {
            let Some(motor) = motor else { continue };
            let [first, second] = inputs[leg].of_motor(i);
            let rate = rates[leg].drive_rates()[i];
            forces.torques[i] = motor.line(first, second).torque_at(rate);
        }
        if let [_, Some(pulley), _] = drives::drive_dofs(at) {
            forces.tension = clutch - constraint_forces[pulley];
        }
        if let Some(foot) = at.foot {
            [forces.normal, forces.along] = contact_forces(engine, foot);
        }
    }
    all
}

/// Returns the power of all constraints at these velocities, without that of clutches on their
/// flywheels.
pub(crate) fn constraints(
    engine: &Engine,
    at: &Addresses,
    qvel: impl Iterator<Item = f64>,
) -> Constraints {
    let data = engine.data();
    let clutches = at.legs.iter().flat_map(|leg| &leg.clutches).flatten();
    let is_wheel = |dof: usize| clutches.clone().any(|clutch| clutch.flywheel[1] == dof);
    let all = data.qfrc_constraint().iter().zip(qvel).enumerate();
    let robot_dofs = all.filter(|(dof, _)| !is_wheel(*dof));
    Constraints {
        power: robot_dofs.map(|(_, (force, rate))| force * rate).sum(),
        limits: data.nl() > 0,
    }
}

/// Returns the forces of the ground on a foot: normal and tangential sum over its contacts \[N\].
fn contact_forces(engine: &Engine, foot: usize) -> [[f64; 3]; 2] {
    let mut forces = [[0.0; 3]; 2];
    for (id, contact) in engine.data().contact().iter().enumerate() {
        let of = |geom: i32| usize::try_from(geom).is_ok_and(|geom| geom == foot);
        let [first, second] = contact.geom.map(of);
        if !(first || second) {
            continue;
        }
        let of_contact = contact_force(engine, id, foot);
        for (sum, part) in forces.iter_mut().flatten().zip(of_contact.iter().flatten()) {
            *sum += part;
        }
    }
    forces
}

/// Returns the force of a contact on a geom that it has: normal and tangential, world axes \[N\].
pub(crate) fn contact_force(engine: &Engine, id: usize, geom: usize) -> [[f64; 3]; 2] {
    let contact = &engine.data().contact()[id];
    // MuJoCo's contact force acts on the second geom.
    let is_second = usize::try_from(contact.geom[1]) == Ok(geom);
    let sign = if is_second { 1.0 } else { -1.0 };
    let force = engine.data().contact_force(id);
    let [normal, along, across] = [0, 1, 2].map(|row| sign * force[row]);
    let axis = |row: usize, i: usize| contact.frame[3 * row + i];
    [
        [0, 1, 2].map(|i| normal * axis(0, i)),
        [0, 1, 2].map(|i| along * axis(1, i) + across * axis(2, i)),
    ]
}
