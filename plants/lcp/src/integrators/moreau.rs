//! Moreau's midpoint rule: constraints as impulses over a step, independent of their time within
//! it.
//!
//! ```text
//! q̄ = q ⊕ ½h u_a                                               q⁺ = q̄ ⊕ ½h u_b
//! (H(q̄) + ½h D)(u_b − u_a) = h (f(q̄, u_a) + ½(g(u_a) + g(u_b))) + Jᵀ P
//! 0 ≤ P ⊥ J u_b + o ≥ 0          D: friction of the joints, damping of the motors
//! ```
//!
//! Momenta are constant in the half steps ([`drift`]); forces and impulses change them in the
//! middle ([`kick`]). Without impulses this is the generalised leapfrog: second order, symplectic,
//! time-reversible. Momentum is balanced to round-off; the energy oscillates by an error of second
//! order and does not drift. J is that at q̄; g is the gap at the beginning of the step,
//! extrapolated from the middle, `g(q̄) − ½h J u_a`, and `o = max(γ g/h, J u_a, 0)`.
//!
//! The impulses of a step give no energy in total: `J u_b` is at most `−J u_a`, and friction that
//! would do work acts against `½(u_a + u_b)` ([`impulses`]). An overlap is corrected by a shift of
//! the positions without velocities ([`overlaps`]), whose work is deducted from later
//! losses.
//!
//! A step is of first order where a constraint opens or closes. One that leaves a new overlap of
//! more than 10 µm is halved, so that a landing is resolved more finely than the rest.

mod drift;
mod drives;
mod impulses;
mod inertia;
mod kick;
mod momentum;
mod overlaps;
mod solved_step;
mod stages;

use super::run_state::RunState;
use super::step_error::StepError;
use crate::constraints::saturation::Effort;
use crate::model::Model;
use crate::model::chain::friction_torques;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::rotation;

use drives::{TorqueSpeedLines, mean_commanded, torque_speed_lines};
use impulses::ImpulseSolver;
pub(crate) use impulses::LastImpulses;
use inertia::Memory;
use overlaps::check_feet;
use solved_step::SolvedStep;
use stages::{FirstHalf, Kicked, Middle};

/// A motor that changes more often is at the limit of its torque, where both modes are valid.
const CHANGES_MAX: u32 = 4;

/// Maximum number of halvings of a step whose impulses are not found, or that leaves an overlap.
const HALVINGS_MAX: u32 = 8;

/// Moreau's midpoint rule with its workspace.
#[derive(Debug, Clone, Default)]
pub(crate) struct Moreau<const N: usize> {
    solver: ImpulseSolver<N>,
    memory: Box<Memory<N>>,
}

impl<const N: usize> Moreau<N> {
    /// Returns the impulses of the last step.
    pub(crate) fn last_impulses(&self) -> &LastImpulses {
        &self.solver.last_impulses
    }

    /// Replaces the impulses of the last step.
    pub(crate) fn set_last_impulses(&mut self, last_impulses: &LastImpulses) {
        self.solver.last_impulses = *last_impulses;
    }

    /// Advances by `seconds`; halves a step whose impulses are not found, or that leaves an
    /// overlap.
    pub(crate) fn advance(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        self.advance_halved(model, run, seconds, HALVINGS_MAX)
    }

    fn advance_halved(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
        halvings: u32,
    ) -> Result<(), StepError> {
        // Legs on a fixed trunk are independent: a landing of one does not divide the steps of all.
        self.solver.halvable = halvings > 0 && model.is_free();
        match self.step(model, run, seconds) {
            Err(
                StepError::SolveError(_)
                | StepError::NotConverged { .. }
                | StepError::ImpactGivesEnergy(_)
                | StepError::Overlap { .. },
            ) if halvings > 0 => {
                run.counts.fallbacks += 1;
                self.advance_halved(model, run, 0.5 * seconds, halvings - 1)?;
                self.advance_halved(model, run, 0.5 * seconds, halvings - 1)
            }
            done => done,
        }
    }

    fn step(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        run.hold_mean_load(model, seconds);
        let before = run.state;
        let commanded = mean_commanded(model, &run.mode.commands, &before, seconds);
        let mut lines = torque_speed_lines(
            model,
            &run.mode.commands,
            [before.rates[0], before.pulley_rate],
        );
        for change in 0.. {
            let solved = self.solve_step(model, run, commanded, &lines, seconds);
            self.solver.instant.drain_counts(&mut run.counts);
            let solved = solved?;
            if self.solver.halvable {
                check_feet(model, [&before, &solved.after], seconds)?;
            }
            let (half, per) = (Lanes::splat(0.5), Lanes::splat(1.0 / seconds));
            let after = &solved.after;
            let effort = Effort {
                torques: solved.torques,
                actual: [
                    (after.rates[0] - before.rates[0]) * per,
                    (after.pulley_rate - before.pulley_rate) * per,
                ],
                commanded,
                rates: [
                    solved.mean[0],
                    half * (before.pulley_rate + after.pulley_rate),
                ],
            };
            let saturated = run.mode.saturate(model, &effort);
            let now = torque_speed_lines(model, &run.mode.commands, effort.rates);
            if change == CHANGES_MAX || !saturated && now == lines {
                self.finish(model, run, &solved, seconds);
                break;
            }
            lines = now;
        }
        run.check_finite(model)
    }

    /// Computes the end of a step under these drives.
    fn solve_step(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        commanded: [Lanes; 2],
        lines: &TorqueSpeedLines,
        seconds: f64,
    ) -> Result<SolvedStep<N>, StepError> {
        run.counts.evaluations += 1;
        let Self { solver, memory } = self;
        let before = &run.state;
        memory.start.update(model, &run.mode, &before.angles);
        let first = FirstHalf::of(model, &memory.start, before, 0.5 * seconds)?;
        let dynamics = run.dynamics(model, 0.0);
        let drives = (commanded, lines);
        let middle = Middle::of(&dynamics, &mut memory.middle, &first, drives, seconds);
        let until = (&first, &middle);
        let kicked = Kicked::of(solver, &dynamics, memory, until, seconds)?;
        let after = kicked.second_half(solver, &dynamics, memory, until, seconds);
        Ok(kicked.solved(&dynamics, memory, until, after, seconds))
    }

    /// Accepts the end of the step and enters its work in the energy balance.
    fn finish(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        solved: &SolvedStep<N>,
        seconds: f64,
    ) {
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5 * seconds));
        let after = solved.after;
        let [hip, knee] = solved.torques;
        run.impulse_sums.hip += h * hip;
        run.impulse_sums.knee += h * knee;
        run.impulse_sums.cable += h * solved.tension;
        let wound = half * (run.state.pulley_rate + after.pulley_rate);
        run.ledger.actuator += (solved.hip_work + knee * wound).sum();
        run.ledger.external += solved.external;
        let torques = friction_torques(&model.side_by_side, &solved.mean);
        for i in 0..N {
            run.ledger.dissipated -= (h * torques[i] * solved.mean[i]).sum();
        }
        self.solver.record_impulses(model, run, seconds);
        let end = &mut self.memory.end.inertia;
        end.chain.rates = after.rates;
        if let Some(base) = &mut end.base {
            base.rotation = rotation(after.attitude);
        }
        let stored = end.stored(model, &model.side_by_side, &after);
        run.ledger.close_step(stored);
        core::mem::swap(&mut self.memory.start, &mut self.memory.end);
        run.state = after;
        run.elapsed_s += seconds;
        run.counts.steps += 1;
    }
}

#[cfg(test)]
mod tests;
