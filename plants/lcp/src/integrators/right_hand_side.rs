//! Right-hand side of the equations of motion in the mode of a run, with its workspace.

use twinrig_legged::DriveModels;

use super::impulse_sums::ImpulseSums;
use super::run_state::RunState;
use crate::constraints::guards::Guards;
use crate::constraints::motion::Motion;
use crate::constraints::saturation::Effort;
use crate::constraints::workspace::Workspace;
use crate::model::Model;
use crate::model::drives::commanded_acceleration;
use crate::model::real::Lanes;
use crate::model::state::{Slope, State};

/// Evaluates motions and counts the evaluations.
#[derive(Debug, Clone, Default)]
pub(crate) struct RightHandSide<const N: usize> {
    /// Holds the contact forces of the last motion.
    pub(crate) workspace: Workspace<f64, N>,
}

impl<const N: usize> RightHandSide<N> {
    /// Returns the right-hand side in a state without intermediate results. Adds the impulses over
    /// the given time \[s\] to the sums.
    #[inline(never)]
    pub(crate) fn stage(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        state: &State<Lanes, N>,
        recovery: f64,
        accumulate: Option<(Lanes, &mut ImpulseSums)>,
    ) -> Slope<Lanes, N> {
        if !run.mode.contacts.is_empty() {
            let motion = self.motion(model, run, state, recovery);
            if let Some((seconds, impulse_sums)) = accumulate {
                self.add_impulses(model, run, state, &motion, seconds, impulse_sums);
            }
            return motion.slope;
        }
        run.counts.evaluations += 1;
        let dynamics = run.dynamics(model, recovery);
        let (slope, forces) = dynamics.slope_without_contacts(state);
        if let Some((seconds, impulse_sums)) = accumulate {
            impulse_sums.add_drives(model, &forces, seconds);
        }
        slope
    }

    /// Returns the right-hand side in a state with its intermediate results.
    #[inline(never)]
    pub(crate) fn motion(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        state: &State<Lanes, N>,
        recovery: f64,
    ) -> Motion<Lanes, N> {
        run.counts.evaluations += 1;
        run.dynamics(model, recovery)
            .motion(state, &mut self.workspace)
    }

    /// Computes the same in place.
    #[inline(never)]
    pub(crate) fn motion_into(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        state: &State<Lanes, N>,
        recovery: f64,
        motion: &mut Motion<Lanes, N>,
    ) {
        run.counts.evaluations += 1;
        run.dynamics(model, recovery)
            .motion_into(state, &mut self.workspace, motion);
    }

    /// Adds the impulses of the last motion, in this state, over `weight` seconds.
    #[inline(always)]
    pub(crate) fn add_impulses(
        &self,
        model: &Model<N>,
        run: &RunState<N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        impulse_sums.add_drives(model, &motion.forces, weight);
        self.add_ground_impulses(model, run, state, motion, weight, impulse_sums);
    }

    /// Adds the ground impulses of the last motion, in this state, over `weight` seconds.
    pub(crate) fn add_ground_impulses(
        &self,
        model: &Model<N>,
        run: &RunState<N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        weight: Lanes,
        impulse_sums: &mut ImpulseSums,
    ) {
        let (contacts, forces) = (&run.mode.contacts, &self.workspace.forces);
        impulse_sums.add_contact_forces(model, contacts, forces, state, motion, weight);
    }

    /// Computes the guards of the last motion, in this state, in place.
    pub(crate) fn update_guards(
        &self,
        model: &Model<N>,
        run: &RunState<N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
        guards: &mut Guards,
    ) {
        guards.update(&run.dynamics(model, 0.0), state, motion, &self.workspace);
    }

    /// Returns the guards of the last motion, in this state.
    pub(crate) fn guards(
        &self,
        model: &Model<N>,
        run: &RunState<N>,
        state: &State<Lanes, N>,
        motion: &Motion<Lanes, N>,
    ) -> Guards {
        Guards::new(&run.dynamics(model, 0.0), state, motion, &self.workspace)
    }

    /// Updates the saturation of the motors after new commands or an event; returns whether any
    /// motor changed.
    pub(crate) fn follow_command(&mut self, model: &Model<N>, run: &mut RunState<N>) -> bool {
        /// A motor that changes more often is at the limit of its torque, where both modes are
        /// valid.
        const CHANGES_MAX: usize = 4;
        let Some(DriveModels::Servos(servos)) = model.drives else {
            return false;
        };
        if servos
            .both()
            .iter()
            .all(|servo| servo.torque().is_infinite())
        {
            return false;
        }
        for changes in 0..CHANGES_MAX {
            let state = run.state;
            let motion = self.motion(model, run, &state, 0.0);
            let commands = &run.mode.commands;
            let effort = Effort {
                torques: [motion.forces.hip_torque, motion.forces.knee_torque],
                actual: [motion.slope.rates[0], motion.slope.pulley_rate],
                rates: [state.rates[0], state.pulley_rate],
                commanded: [
                    commanded_acceleration(
                        &servos.hip,
                        commands.hip,
                        state.angles[0],
                        state.rates[0],
                    ),
                    commanded_acceleration(
                        &servos.knee,
                        commands.pulley,
                        state.pulley,
                        state.pulley_rate,
                    ),
                ],
            };
            if !run.mode.saturate(model, &effort) {
                return changes > 0;
            }
        }
        true
    }
}
