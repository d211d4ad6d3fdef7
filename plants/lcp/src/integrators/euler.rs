//! Explicit and symplectic Euler methods: steps of fixed length without event location, for
//! comparison.
//!
//! ```text
//! explicit    x⁺ = x + h v     v⁺ = v + h a        semi-implicit    v⁺ = v + h a     x⁺ = x + h v⁺
//! ```
//!
//! Constraints that are closed at the start of a step are active in it: with the explicit method at
//! acceleration level, after an impulse where the gap was closing; with the symplectic method at
//! velocity level, impulses included ([`crate::constraints::events::constrained`]). A gap closes up to one step
//! late, so both are of first order.

use twinrig_contact::Method;

use crate::constraints::events::constrained::{Constrained, ConstraintLevel};
use crate::constraints::mode::Mode;
use crate::constraints::motion::quaternion_rate;
use crate::integrators::flow::Flow;
use crate::integrators::step_error::StepError;
use crate::model::articulated::into_world;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;
use crate::model::state::normalised;

/// Decay of constraint errors per step, critically damped.
const RECOVERY: f64 = 0.2;

impl<const N: usize> Flow<N> {
    /// Advances by `seconds` in one explicit step.
    pub(crate) fn run_explicit_euler(&mut self, seconds: f64) -> Result<(), StepError> {
        self.follow_command();
        let before = self.run.state;
        self.apply_impact()?;
        let recovery = RECOVERY / seconds;
        let level = ConstraintLevel::Acceleration {
            stiffness: recovery * recovery,
            damping: 2.0 * recovery,
        };
        let constrained = self.constrain(level, Method::Newton, seconds)?;
        let end = self.explicit(&constrained, seconds);
        self.finish_step(&before, end, &constrained, seconds)
    }

    /// Advances by `seconds` in one step of the symplectic method.
    pub(crate) fn run_semi_implicit(&mut self, seconds: f64) -> Result<(), StepError> {
        self.follow_command();
        let before = self.run.state;
        let level = ConstraintLevel::Velocity { seconds };
        let constrained = self.constrain(level, Method::Newton, seconds)?;
        let mut slope = constrained.motion.slope;
        let h = Lanes::splat(seconds);
        for (rate, acceleration) in slope.angles.iter_mut().zip(&slope.rates) {
            *rate += h * *acceleration;
        }
        slope.pulley += h * slope.pulley_rate;
        if self.model.is_free() {
            let after = |now: [f64; 3], change: [f64; 3]| -> [f64; 3] {
                std::array::from_fn(|i| now[i] + seconds * change[i])
            };
            let rotation = constrained.motion.articulated.rotation();
            slope.position = into_world(&rotation, after(before.velocity, slope.velocity));
            let turning = after(before.turning, slope.turning);
            slope.attitude = quaternion_rate(before.attitude, turning);
        }
        let free = self.model.is_free();
        let end = normalised(&before.along(h, &slope, free), free);
        self.finish_step(&before, end, &constrained, seconds)
    }

    /// Stops closing gaps by impulses.
    pub(crate) fn apply_impact(&mut self) -> Result<(), StepError> {
        let mut instant = core::mem::take(&mut self.instant);
        let mut state = self.run.state;
        let dynamics = self.run.dynamics(&self.model, 0.0);
        let mut legs = [0, 1, 2, 3];
        let legs = &mut legs[..self.model.legs.len()];
        let totals = instant.impact(&dynamics, &mut state, legs);
        self.instant = instant;
        let totals = totals?;
        self.run.state = state;
        self.run.ledger.impact += totals.impact;
        self.run.ledger.dissipated += totals.friction;
        let sums = self.run.impulse_sums.ground.iter_mut().flatten();
        for (sum, part) in sums.zip(totals.ground.iter().flatten()) {
            *sum += part;
        }
        Ok(())
    }

    /// Computes the constraint forces of a step of `seconds`; counts newly active constraints as
    /// events.
    pub(crate) fn constrain(
        &mut self,
        level: ConstraintLevel,
        method: Method,
        seconds: f64,
    ) -> Result<Constrained<N>, StepError> {
        self.run.counts.evaluations += 1;
        let mut instant = core::mem::take(&mut self.instant);
        let mut mode = self.run.mode;
        let dynamics = self.run.dynamics(&self.model, 0.0);
        let found = instant.constrain(
            &dynamics,
            &self.run.state,
            level,
            method,
            seconds,
            &mut mode,
        );
        instant.drain_counts(&mut self.run.counts);
        self.instant = instant;
        let found = found?;
        self.run.counts.events += mode.activated_since(&self.run.mode);
        self.run.mode = mode;
        Ok(found)
    }

    /// Returns the end state of an explicit step.
    pub(crate) fn explicit(&self, constrained: &Constrained<N>, seconds: f64) -> State<Lanes, N> {
        let free = self.model.is_free();
        let slope = &constrained.motion.slope;
        normalised(
            &self.run.state.along(Lanes::splat(seconds), slope, free),
            free,
        )
    }

    /// Accepts the end state of a step and enters its energies and impulses. `before` is the state
    /// before impacts.
    pub(crate) fn finish_step(
        &mut self,
        before: &State<Lanes, N>,
        end: State<Lanes, N>,
        constrained: &Constrained<N>,
        seconds: f64,
    ) -> Result<(), StepError> {
        let (motion, start) = (&constrained.motion, self.run.state);
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5));
        // Forces at the start times mean rates: the work that agrees with the change of velocities.
        let mean = |a: Lanes, b: Lanes| half * (a + b);
        let mut friction = Lanes::zero();
        for (i, torque) in motion.articulated.chain.friction.iter().enumerate() {
            friction -= *torque * mean(start.rates[i], end.rates[i]);
        }
        let drives = motion.forces.hip_torque * mean(start.rates[0], end.rates[0])
            + motion.forces.knee_torque * mean(start.pulley_rate, end.pulley_rate);
        self.run.ledger.dissipated += seconds * friction.sum() + constrained.friction;
        self.run.ledger.actuator += seconds * drives.sum();
        self.run.ledger.impact += constrained.impact;
        self.run.impulse_sums.hip += h * motion.forces.hip_torque;
        self.run.impulse_sums.knee += h * motion.forces.knee_torque;
        self.run.impulse_sums.cable +=
            h * motion.forces.forces[crate::model::leg_constraints::CABLE];
        let sums = self.run.impulse_sums.ground.iter_mut().flatten();
        for (sum, force) in sums.zip(constrained.ground.iter().flatten()) {
            *sum += seconds * force;
        }
        self.estimate = self.local_error(before, &end, seconds);
        self.run.state = end;
        self.run.counts.steps += 1;
        if !self.estimate.is_finite() {
            return Err(StepError::NotFinite);
        }
        let stored = self.stored();
        self.run.ledger.close_step(stored);
        Ok(())
    }

    /// Returns the local error of a step \[m\]: the method takes a varying rate as constant, so
    /// half the change of the rate times the step bounds the displacement of a foot or the trunk.
    fn local_error(&self, before: &State<Lanes, N>, end: &State<Lanes, N>, seconds: f64) -> f64 {
        let norm = |a: [f64; 3], b: [f64; 3]| {
            libm::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
        };
        let reach = self.model.reach;
        let mut change =
            norm(before.velocity, end.velocity) + reach * norm(before.turning, end.turning);
        let mut legs = Lanes::zero();
        for (a, b) in before.rates.iter().zip(&end.rates) {
            legs += (*a - *b).abs() * Lanes::splat(reach);
        }
        let legs = &legs.to_array()[..self.model.legs.len()];
        // A sum propagates NaN; a maximum may not.
        let most = legs.iter().fold(0.0_f64, |most, leg| most.max(*leg));
        let all: f64 = legs.iter().sum();
        change += if all.is_finite() { most } else { all };
        0.5 * seconds * change
    }
}

impl Mode {
    /// Deactivates stops, cables and contacts.
    pub(crate) fn deactivate(&mut self) {
        let none = Lanes::zero();
        let active = &mut self.active;
        for constraint in [
            &mut active.closed,
            &mut active.open,
            &mut active.extended,
            &mut active.bottomed,
            &mut active.cable,
        ] {
            *constraint = none;
        }
        self.contacts.clear();
    }

    /// Returns the number of constraints that are active now and were not in `before`.
    fn activated_since(&self, before: &Self) -> u64 {
        let all = |mode: &Self| {
            let active = &mode.active;
            [
                active.closed,
                active.open,
                active.extended,
                active.bottomed,
                active.cable,
            ]
        };
        let mut activated = 0;
        for (now, then) in all(self).into_iter().zip(all(before)) {
            for (now, then) in now.to_array().into_iter().zip(then.to_array()) {
                activated += u64::from(now != 0.0 && then == 0.0);
            }
        }
        for contact in &self.contacts {
            let known = |other: &crate::constraints::mode::Contact| {
                (other.leg, other.links) == (contact.leg, contact.links)
            };
            activated += u64::from(!before.contacts.iter().any(known));
        }
        activated
    }
}

#[cfg(test)]
mod tests;
