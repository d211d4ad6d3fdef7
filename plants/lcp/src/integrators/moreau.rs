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

use super::run_state::RunState;
use super::step_error::StepError;
use crate::constraints::saturation::Effort;
use crate::model::Model;
use crate::model::chain::friction_torques;
use crate::model::leg_constraints::HIP;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::rotation;

use drift::{HalfStep, Momentum, Rates, advance_joints, rotated};
use drives::{
    Hip, MeanDrive, TorqueSpeedLines, drive_over, drive_torques, mean_commanded, torque_speed_lines,
};
use impulses::ImpulseSolver;
pub(crate) use impulses::LastImpulses;
use inertia::{Memory, unload_middle};
use momentum::Geometry;
use overlaps::check_feet;
use solved_step::SolvedStep;

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
    #[expect(
        clippy::too_many_lines,
        reason = "the stages of one step, in the order of the equations"
    )]
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
        let half = 0.5 * seconds;
        memory.start.renew(model, &run.mode, &before.angles);
        let (start, legs) = (&memory.start.geometry, &model.side_by_side);
        let from = start.momenta(legs, &before.rates, before.turning);
        let hip_inertia = memory.start.hips[1];
        let half_step = HalfStep {
            model,
            inertia: &memory.start.inertia,
            hip_inertia,
            seconds: half,
        };
        let initial = Rates {
            links: before.rates,
            turning: before.turning,
        };
        let (rates, last_momenta) = half_step.rates(&before.angles, initial, &from)?;
        let mut middle = *before;
        (middle.rates, middle.turning) = (rates.links, rates.turning);
        advance_joints(&mut middle, half);

        let dynamics = run.dynamics(model, 0.0);
        let MeanDrive { drive, hip_damping } =
            drive_over(&dynamics, &middle, commanded, lines, seconds);
        unload_middle(&mut memory.middle, model, &run.mode, &middle, &drive, half);
        let geometry = Geometry::of(model, &memory.middle);
        let mut momentum = None;
        if let Some((base, (body, middle_body))) = memory
            .middle
            .base
            .as_mut()
            .zip(start.body.zip(geometry.body))
        {
            let mut robot = Momentum::of(model, before, &body, from.relative, from.spin);
            robot.drift(half);
            middle.attitude = rotated(before.attitude, rates.turning, half);
            let relative = geometry.relative(legs, &rates.links, rates.turning);
            robot.place_trunk(&mut middle, &middle_body, relative);
            base.rotation = rotation(middle.attitude);
            momentum = Some((robot, middle_body));
        }
        let pushed = dynamics.load.as_ref().map(|load| {
            let chain = &memory.middle.chain;
            let turns = [&chain.sines, &chain.cosines];
            load.forces(&model.side_by_side, turns, &memory.middle.rotation())
        });
        let kick = (&geometry, &rates, &last_momenta, pushed.as_ref());
        let (accelerations, torques) = solver.impulses(
            &dynamics,
            &mut memory.middle,
            &middle,
            &drive,
            kick,
            seconds,
        )?;
        let tension = solver.instant.tension(seconds);

        let legs = &model.side_by_side;
        let h = Lanes::splat(seconds);
        let mut after = middle;
        for i in 0..N {
            after.rates[i] += h * accelerations.links[i];
        }
        for i in 0..3 {
            after.turning[i] += seconds * accelerations.trunk[3 + i];
        }
        let radius = legs.pulley_radius;
        let winding = drive.pulley_acceleration - drive.pulley_mobility * radius * tension;
        after.pulley_rate += h * winding;
        let mean = std::array::from_fn(|i| Lanes::splat(0.5) * (rates.links[i] + after.rates[i]));
        let last = Rates {
            links: after.rates,
            turning: after.turning,
        };
        let motors = (memory.start.hips[0], &drive);
        let shifting = solver.correct_overlaps(model, &memory.middle, motors, &after, seconds);
        let shifting = shifting.as_ref();
        // Momenta of the links under all forces.
        let change = std::array::from_fn(|i| last.links[i] - rates.links[i]);
        let damping = friction_torques(legs, &change);
        let mut momenta: [Lanes; N] = std::array::from_fn(|i| {
            from.links[i] + h * torques[i] + Lanes::splat(half) * damping[i]
        });
        momenta[0] += hip_inertia * before.rates[0] - Lanes::splat(half) * hip_damping * change[0];

        if let Some(shifting) = shifting {
            (after.rates, after.turning) = (shifting.rates.links, shifting.rates.turning);
            after.pulley += Lanes::splat(half) * shifting.pulley;
        }
        advance_joints(&mut after, half);
        memory.end.renew(model, &run.mode, &after.angles);
        let (end, legs) = (&memory.end.geometry, &model.side_by_side);
        let mut spin = [0.0; 3];
        if let Some(((robot, body), end_body)) = momentum.as_mut().zip(end.body) {
            let mut impulse = solver.instant.wrench();
            if let Some(pushed) = &pushed {
                for (sum, force) in impulse.iter_mut().zip(pushed.trunk) {
                    *sum += seconds * force;
                }
            }
            let velocity_change = robot.apply(&impulse, &memory.middle, body, seconds);
            let [forward, _, up] = velocity_change.map(Lanes::splat);
            let chain = &memory.middle.chain;
            for i in 0..N {
                let along = chain.cosines[i] * forward + chain.sines[i] * up;
                momenta[i] -= legs.moments[i] * along;
            }
            robot.drift(half);
            if let Some(shifting) = shifting {
                robot.shift(shifting.push, &memory.middle, body, half);
            }
            after.attitude = rotated(middle.attitude, after.turning, half);
            spin = robot.spin_in(after.attitude);
            *body = end_body;
        }
        let rates_after = memory.end.inertia.rates_of(&momenta, spin, last.links[0]);
        (after.rates, after.turning) = (rates_after.links, rates_after.turning);
        if let Some((robot, body)) = momentum {
            let relative = end.relative(legs, &after.rates, after.turning);
            robot.place_trunk(&mut after, &body, relative);
        }
        let mut solved = SolvedStep {
            after,
            mean,
            external: pushed.map_or(0.0, |pushed| {
                // At the means of the velocities before and after the kick.
                let mut halfway = middle;
                halfway.rates = mean;
                for i in 0..3 {
                    halfway.velocity[i] += half * accelerations.trunk[i];
                    halfway.turning[i] += half * accelerations.trunk[3 + i];
                }
                seconds * pushed.power(&halfway).sum()
            }),
            tension,
            torques: [Lanes::zero(); 2],
            hip_work: Lanes::zero(),
        };
        // A hip at constant rate changes its momentum as its leg bends.
        let at = |geometry: &Geometry<N>, rates: &Rates<N>| {
            let momenta = geometry.momenta(legs, &rates.links, rates.turning);
            momenta.links[0]
        };
        let ends = Rates {
            links: solved.after.rates,
            turning: solved.after.turning,
        };
        if model.drives.is_some() {
            let hip = Hip {
                rates: [rates.links[0], last.links[0]],
                acceleration: accelerations.links[0],
                damping: hip_damping,
                imposed_torque: memory.middle.mobility.forces(&accelerations.torques)[HIP],
                momentum_change: [
                    at(&geometry, &rates) - from.links[0],
                    at(end, &ends) - at(&geometry, &last),
                ],
            };
            drive_torques(&dynamics, &mut solved, &drive, &hip, winding, seconds);
        }
        Ok(solved)
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
