//! Steps of the engine alone: the loop that a user of the engine writes without this crate.
//!
//! Springs are spring joints of the engine, joint friction is a motor and the stops of the knee are
//! a limit of its revolute joint, so that the engine solves them together with the joint. The stops
//! of the parallel rod are ropes.

use twinrig_legged::Ledger;

use crate::divergence::Divergence;
use crate::robot::Machine;

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
