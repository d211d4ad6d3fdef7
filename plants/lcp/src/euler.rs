//! Euler's methods, explicit and symplectic: steps of fixed length that look for no events. They are here to be compared with.
//!
//! ```text
//! explicit    x⁺ = x + h v     v⁺ = v + h a        semi-implicit    v⁺ = v + h a     x⁺ = x + h v⁺
//! ```
//!
//! What is found closed when a step begins holds in the step: at the level of accelerations with the explicit method, after
//! an impulse where it was closing; at the level of velocities with the other, impulses included
//! ([`crate::events::constrained`]). A gap closes up to a step too late, and so both are of first order.

use twinrig_contact::Method;

use crate::articulated::into_world;
use crate::events::constrained::{Constrained, Demand};
use crate::flow::{Flow, FlowError};
use crate::mode::Mode;
use crate::motion::{Scene, quaternion_rate};
use crate::real::{Lanes, Real};
use crate::state::State;
use crate::state::normalised;

/// Errors of constraints are taken back at this rate per step, critically damped.
const RECOVERY: f64 = 0.2;

impl<const N: usize> Flow<N> {
    /// Moves on by `seconds` in one explicit step.
    pub(crate) fn run_explicit_euler(&mut self, seconds: f64) -> Result<(), FlowError> {
        self.follow_command();
        let before = self.state;
        self.collide()?;
        let recovery = RECOVERY / seconds;
        let demand = Demand::Acceleration {
            stiffness: recovery * recovery,
            damping: 2.0 * recovery,
        };
        let constrained = self.constrain(demand, Method::Newton, seconds)?;
        let end = self.explicit(&constrained, seconds);
        self.conclude(&before, end, &constrained, seconds)
    }

    /// Moves on by `seconds` in one step of the symplectic method.
    pub(crate) fn run_semi_implicit(&mut self, seconds: f64) -> Result<(), FlowError> {
        self.follow_command();
        let before = self.state;
        let demand = Demand::Velocity { seconds };
        let constrained = self.constrain(demand, Method::Newton, seconds)?;
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
        self.conclude(&before, end, &constrained, seconds)
    }

    /// Stops what closes, by impulses.
    pub(crate) fn collide(&mut self) -> Result<(), FlowError> {
        let mut instant = core::mem::take(&mut self.instant);
        let mut state = self.state;
        let scene = Scene::new(&self.model, &self.model.side_by_side, &self.mode, 0.0);
        let mut legs = [0, 1, 2, 3];
        let legs = &mut legs[..self.model.legs.len()];
        let toll = instant.impact(&scene, &mut state, legs);
        self.instant = instant;
        let toll = toll?;
        self.state = state;
        self.ledger.impact += toll.impact;
        self.ledger.dissipated += toll.friction;
        let sums = self.impulse_sums.ground.iter_mut().flatten();
        for (sum, part) in sums.zip(toll.ground.iter().flatten()) {
            *sum += part;
        }
        Ok(())
    }

    /// Finds the forces of a step of `seconds`, and counts what begins to push as an event.
    pub(crate) fn constrain(
        &mut self,
        demand: Demand,
        method: Method,
        seconds: f64,
    ) -> Result<Constrained<N>, FlowError> {
        self.counts.evaluations += 1;
        let mut instant = core::mem::take(&mut self.instant);
        let mut mode = self.mode;
        let scene = Scene::new(&self.model, &self.model.side_by_side, &self.mode, 0.0);
        let found = instant.constrain(&scene, &self.state, demand, method, seconds, &mut mode);
        (self.counts.solver_iterations, self.counts.factorisations) =
            (instant.iterations, instant.factorisations);
        self.instant = instant;
        let found = found?;
        self.counts.events += mode.news(&self.mode);
        self.mode = mode;
        Ok(found)
    }

    /// Where an explicit step ends.
    pub(crate) fn explicit(&self, constrained: &Constrained<N>, seconds: f64) -> State<Lanes, N> {
        let free = self.model.is_free();
        let slope = &constrained.motion.slope;
        normalised(&self.state.along(Lanes::splat(seconds), slope, free), free)
    }

    /// Takes the end of a step for the present, and writes up what has flowed. `before` is what there was before impacts.
    pub(crate) fn conclude(
        &mut self,
        before: &State<Lanes, N>,
        end: State<Lanes, N>,
        constrained: &Constrained<N>,
        seconds: f64,
    ) -> Result<(), FlowError> {
        let (motion, start) = (&constrained.motion, self.state);
        let (h, half) = (Lanes::splat(seconds), Lanes::splat(0.5));
        // Forces of the start on the way of the mean rates: the work that they do by the change of velocities.
        let mean = |a: Lanes, b: Lanes| half * (a + b);
        let mut taken = Lanes::zero();
        for (i, torque) in motion.articulated.chain.friction.iter().enumerate() {
            taken -= *torque * mean(start.rates[i], end.rates[i]);
        }
        let given = motion.forces.hip_torque * mean(start.rates[0], end.rates[0])
            + motion.forces.knee_torque * mean(start.pulley_rate, end.pulley_rate);
        self.ledger.dissipated += seconds * taken.sum() + constrained.friction;
        self.ledger.actuator += seconds * given.sum();
        self.ledger.impact += constrained.impact;
        self.impulse_sums.hip += h * motion.forces.hip_torque;
        self.impulse_sums.knee += h * motion.forces.knee_torque;
        self.impulse_sums.cable += h * motion.forces.forces[crate::constraints::CABLE];
        let sums = self.impulse_sums.ground.iter_mut().flatten();
        for (sum, force) in sums.zip(constrained.ground.iter().flatten()) {
            *sum += seconds * force;
        }
        self.estimate = self.bend(before, &end, seconds);
        self.state = end;
        self.counts.steps += 1;
        if !self.estimate.is_finite() {
            return Err(FlowError::NotFinite);
        }
        let stored = self.stored();
        self.ledger.close_step(stored);
        Ok(())
    }

    /// What a step leaves out: it takes a rate for constant that was another at its other end. Half the difference, over the
    /// step, is how far a foot or the trunk is wrong \[m\].
    fn bend(&self, before: &State<Lanes, N>, end: &State<Lanes, N>, seconds: f64) -> f64 {
        let size = |a: [f64; 3], b: [f64; 3]| {
            libm::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
        };
        let reach = self.model.reach;
        let mut change =
            size(before.velocity, end.velocity) + reach * size(before.turning, end.turning);
        let mut legs = Lanes::zero();
        for (a, b) in before.rates.iter().zip(&end.rates) {
            legs += (*a - *b).abs() * Lanes::splat(reach);
        }
        let legs = &legs.to_array()[..self.model.legs.len()];
        // A sum, not a maximum, to keep what is not a number.
        let most = legs.iter().fold(0.0_f64, |most, leg| most.max(*leg));
        let all: f64 = legs.iter().sum();
        change += if all.is_finite() { most } else { all };
        0.5 * seconds * change
    }
}

impl Mode {
    /// Lets go of stops, cables and feet.
    pub(crate) fn release(&mut self) {
        let none = Lanes::zero();
        let active = &mut self.active;
        for held in [
            &mut active.closed,
            &mut active.open,
            &mut active.extended,
            &mut active.bottomed,
            &mut active.cable,
        ] {
            *held = none;
        }
        self.contacts.clear();
    }

    /// How much holds that did not before.
    fn news(&self, before: &Self) -> u64 {
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
        let mut news = 0;
        for (now, then) in all(self).into_iter().zip(all(before)) {
            for (now, then) in now.to_array().into_iter().zip(then.to_array()) {
                news += u64::from(now != 0.0 && then == 0.0);
            }
        }
        for contact in &self.contacts {
            let known = |other: &crate::mode::Contact| {
                (other.leg, other.links) == (contact.leg, contact.links)
            };
            news += u64::from(!before.contacts.iter().any(known));
        }
        news
    }
}

#[cfg(test)]
#[path = "euler_tests.rs"]
mod tests;
