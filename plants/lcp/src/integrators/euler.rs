//! Explicit and symplectic Euler methods: steps of fixed length without event location, for
//! comparison.
//!
//! ```text
//! explicit    x⁺ = x + h v     v⁺ = v + h a        semi-implicit    v⁺ = v + h a     x⁺ = x + h v⁺
//! ```
//!
//! Constraints that are closed at the start of a step are active in it: with the explicit method at
//! acceleration level, after an impulse where the gap was closing; with the symplectic method at
//! velocity level, impulses included ([`crate::constraints::events::constrained`]). A gap closes up
//! to one step late, so both are of first order.

use twinrig_contact::Method;

use super::right_hand_side::RightHandSide;
use super::run_state::RunState;
use super::step_error::StepError;
use crate::constraints::events::Instant;
use crate::constraints::events::constrained::{Constrained, ConstraintLevel};
use crate::model::Model;
use crate::model::leg_constraints::CABLE;
use crate::model::load::Load;
use crate::model::real::{Lanes, Real};
use crate::model::rotation::{into_world, quaternion_rate};
use crate::model::state::{State, normalised};

/// Decay of constraint errors per step, critically damped.
const RECOVERY: f64 = 0.2;

/// Methods of fixed step length, with their workspace.
#[derive(Debug, Clone, Default)]
pub(crate) struct FixedStep<const N: usize> {
    pub(super) rhs: RightHandSide<N>,
    instant: Instant<N>,
    /// Local error of the last step \[m\].
    estimate: f64,
}

impl<const N: usize> FixedStep<N> {
    /// Advances by `seconds` in one explicit step.
    pub(crate) fn explicit_euler(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        self.rhs.follow_command(model, run);
        let before = run.state;
        self.apply_impact(model, run)?;
        let recovery = RECOVERY / seconds;
        let level = ConstraintLevel::Acceleration {
            stiffness: recovery * recovery,
            damping: 2.0 * recovery,
        };
        let constrained = self.constrain(model, run, level, Method::Newton, seconds)?;
        let end = explicit(model, run, &constrained, seconds);
        self.finish_step(model, run, &before, end, &constrained, seconds)
    }

    /// Advances by `seconds` in one step of the symplectic method.
    pub(crate) fn semi_implicit(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        self.rhs.follow_command(model, run);
        let before = run.state;
        let level = ConstraintLevel::Velocity { seconds };
        let constrained = self.constrain(model, run, level, Method::Newton, seconds)?;
        let mut slope = constrained.motion.slope;
        let h = Lanes::splat(seconds);
        for (rate, acceleration) in slope.angles.iter_mut().zip(&slope.rates) {
            *rate += h * *acceleration;
        }
        slope.pulley += h * slope.pulley_rate;
        if model.is_free() {
            let after = |now: [f64; 3], change: [f64; 3]| -> [f64; 3] {
                std::array::from_fn(|i| now[i] + seconds * change[i])
            };
            let rotation = constrained.motion.articulated.rotation();
            slope.position = into_world(&rotation, after(before.velocity, slope.velocity));
            let turning = after(before.turning, slope.turning);
            slope.attitude = quaternion_rate(before.attitude, turning);
        }
        let free = model.is_free();
        let end = normalised(&before.along(h, &slope, free), free);
        self.finish_step(model, run, &before, end, &constrained, seconds)
    }

    /// Stops closing gaps by impulses.
    pub(super) fn apply_impact(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
    ) -> Result<(), StepError> {
        let mut state = run.state;
        let dynamics = run.dynamics(model, 0.0);
        let mut legs = [0, 1, 2, 3];
        let legs = &mut legs[..model.legs.len()];
        let totals = self.instant.impact(&dynamics, &mut state, legs);
        self.instant.drain_counts(&mut run.counts);
        let totals = totals?;
        run.state = state;
        run.ledger.impact += totals.impact;
        run.ledger.dissipated += totals.friction;
        run.impulse_sums.add_ground(&totals.ground);
        Ok(())
    }

    /// Computes the constraint forces of a step of `seconds`; counts newly active constraints as
    /// events.
    pub(super) fn constrain(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        level: ConstraintLevel,
        method: Method,
        seconds: f64,
    ) -> Result<Constrained<N>, StepError> {
        run.counts.evaluations += 1;
        let mut mode = run.mode;
        let dynamics = run.dynamics(model, 0.0);
        let found = self
            .instant
            .constrain(&dynamics, &run.state, level, method, seconds, &mut mode);
        self.instant.drain_counts(&mut run.counts);
        let found = found?;
        run.counts.events += mode.activated_since(&run.mode);
        run.mode = mode;
        Ok(found)
    }

    /// Accepts the end state of a step and enters its energies and impulses. `before` is the state
    /// before impacts.
    pub(super) fn finish_step(
        &mut self,
        model: &Model<N>,
        run: &mut RunState<N>,
        before: &State<Lanes, N>,
        end: State<Lanes, N>,
        constrained: &Constrained<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        let (motion, start) = (&constrained.motion, run.state);
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5));
        // Forces at the start times mean rates: the work that agrees with the change of velocities.
        let mean = |a: Lanes, b: Lanes| half * (a + b);
        let mut friction = Lanes::zero();
        for (i, torque) in motion.articulated.chain.friction.iter().enumerate() {
            friction -= *torque * mean(start.rates[i], end.rates[i]);
        }
        let drives = motion.forces.hip_torque * mean(start.rates[0], end.rates[0])
            + motion.forces.knee_torque * mean(start.pulley_rate, end.pulley_rate);
        run.ledger.dissipated += seconds * friction.sum() + constrained.friction;
        run.ledger.actuator += seconds * drives.sum();
        if let Some(load) = &run.mode.load {
            let articulated = &motion.articulated;
            let turns = [&articulated.chain.sines, &articulated.chain.cosines];
            let forces = Load::<Lanes>::new(load).forces(
                &model.side_by_side,
                turns,
                &articulated.rotation(),
            );
            let power = forces.power(&start) + forces.power(&end);
            run.ledger.external += 0.5 * seconds * power.sum();
        }
        run.ledger.impact += constrained.impact;
        run.impulse_sums.hip += h * motion.forces.hip_torque;
        run.impulse_sums.knee += h * motion.forces.knee_torque;
        run.impulse_sums.cable += h * motion.forces.forces[CABLE];
        let sums = run.impulse_sums.ground.iter_mut().flatten();
        for (sum, force) in sums.zip(constrained.ground.iter().flatten()) {
            *sum += seconds * force;
        }
        self.estimate = local_error(model, before, &end, seconds);
        run.state = end;
        run.counts.steps += 1;
        if !self.estimate.is_finite() {
            return Err(StepError::NotFinite);
        }
        let stored = run.stored(model);
        run.ledger.close_step(stored);
        Ok(())
    }
}

/// Returns the end state of an explicit step.
pub(super) fn explicit<const N: usize>(
    model: &Model<N>,
    run: &RunState<N>,
    constrained: &Constrained<N>,
    seconds: f64,
) -> State<Lanes, N> {
    let free = model.is_free();
    let slope = &constrained.motion.slope;
    normalised(&run.state.along(Lanes::splat(seconds), slope, free), free)
}

/// Returns the local error of a step \[m\]: the method takes a varying rate as constant, so
/// half the change of the rate times the step bounds the displacement of a foot or the trunk.
fn local_error<const N: usize>(
    model: &Model<N>,
    before: &State<Lanes, N>,
    end: &State<Lanes, N>,
    seconds: f64,
) -> f64 {
    let norm = |a: [f64; 3], b: [f64; 3]| {
        libm::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
    };
    let reach = model.reach;
    let mut change =
        norm(before.velocity, end.velocity) + reach * norm(before.turning, end.turning);
    let mut legs = Lanes::zero();
    for (a, b) in before.rates.iter().zip(&end.rates) {
        legs += (*a - *b).abs() * Lanes::splat(reach);
    }
    let legs = &legs.to_array()[..model.legs.len()];
    // A sum propagates NaN; a maximum may not.
    let most = legs.iter().fold(0.0_f64, |most, leg| most.max(*leg));
    let all: f64 = legs.iter().sum();
    change += if all.is_finite() { most } else { all };
    0.5 * seconds * change
}

#[cfg(test)]
mod tests;
