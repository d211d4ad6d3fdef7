//! Explicit Euler at a fixed step, the method of the thesis (sections 2.4 and 2.7.2).

use twinrig_legged::LEGS;

use crate::drives::DriveStep;
use crate::flow::Flow;
use crate::flow_error::FlowError;
use crate::midpoint::advance_positions;
use crate::mobility::Mobility;
use crate::step::StepEnd;

impl Flow {
    /// Advances by one step: positions by the velocities at its start, velocities by the forces
    /// there. Constraints act at velocity level, on the velocities at its end. A step that fails is
    /// not repeated in halves, as its length is that of the method.
    pub(crate) fn explicit_step(&mut self, seconds: f64) -> Result<(), FlowError> {
        let before = self.state;
        let legs = self.model.legs.len();
        self.counts.evaluations += 1;
        self.middle.load = self.mean_load(seconds);
        // The midpoint of a step of no length is its start.
        self.middle.place(&self.model, &before, &before, 0.0)?;
        let mut drives = DriveStep::new(&self.model, &before, &self.inputs, seconds);
        let mut mobility = Mobility::new(&self.model, &self.middle.legs);
        let motion = self.constrained_motion(&mut drives, &mut mobility, true, seconds)?;
        let mut after = before;
        motion.apply(&mut after, seconds, legs);
        let advanced = advance_positions(&self.model, &before, &before, seconds);
        after.copy_positions(&advanced, legs);
        self.next_placement.place(&self.model, &after)?;
        let end = StepEnd {
            after,
            // Springs whose work is not their energy are an error of the method, in its balance.
            energy_defect: [0.0; LEGS],
            torques: drives.torques,
        };
        self.finish(&end, seconds)
    }
}

#[cfg(test)]
mod tests;
