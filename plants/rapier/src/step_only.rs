//! Steps of the engine alone: the loop that a user of the engine writes without this crate.
//!
//! Springs are spring joints of the engine, joint friction is a motor and the stops of the knee are
//! a limit of its revolute joint, so that the engine solves them together with the joint. The stops
//! of the parallel rod are ropes.

use rapier3d_f64::dynamics::{GenericJoint, JointAxis, MotorModel, SpringJointBuilder};
use twinrig_legged::Ledger;

use crate::assembly::Handles;
use crate::divergence::Divergence;
use crate::model::{Leg, Model, Point};
use crate::robot::Machine;
use crate::world::Sets;

/// Index of the knee among the joints of a leg.
const KNEE: usize = 1;

/// Adds friction, and the stops of the knee, to the revolute joint above segment `k`.
pub(crate) fn complete_joint(joint: &mut GenericJoint, leg: &Leg, k: usize) {
    joint
        .set_motor_model(JointAxis::AngX, MotorModel::ForceBased)
        .set_motor_velocity(JointAxis::AngX, 0.0, leg.friction[k]);
    if k == KNEE {
        joint.set_limits(JointAxis::AngX, leg.knee_range());
    }
}

/// Inserts the springs as joints.
pub(crate) fn insert_springs(model: &Model, handles: &Handles, sets: &mut Sets) {
    for (leg, at) in model.legs.iter().zip(&handles.legs) {
        let body = |point: &Point| at.body(handles.trunk, point.body);
        for spring in &leg.springs {
            let [from, to] = &spring.ends;
            let joint = SpringJointBuilder::new(spring.rest, spring.stiffness, 0.0)
                .local_anchor1(from.at)
                .local_anchor2(to.at);
            sets.impulse_joints
                .insert(body(from), body(to), joint, true);
        }
    }
}

impl Machine {
    /// Advances by a step of the engine, and by nothing else.
    pub(crate) fn step_alone(&mut self, seconds: f64) -> Result<(), Divergence> {
        if !self.world.step(seconds, 1.0) {
            return Err(Divergence::not_finite());
        }
        let solver = &self.options.solver;
        let sweeps = solver.pgs_iterations + solver.stabilization_iterations;
        let counts = &mut self.state.counts;
        counts.steps += 1;
        counts.evaluations += 1;
        counts.solver_iterations += u64::from(solver.solver_iterations * sweeps);
        Ok(())
    }

    /// Updates the readings after steps of the engine alone; its energy balance is the stored
    /// energy, without an account of its changes.
    pub(crate) fn read_engine(&mut self) {
        for leg in 0..self.model.legs.len() {
            let angles = self.view(leg).angles(&self.state.legs[leg].angles);
            self.state.legs[leg].angles = angles;
        }
        self.state.ledger = Ledger::opened(self.stored());
    }
}
