//! Forces of closed constraints over a step of fixed length without event location.
//!
//! The constraints closed at the start of the step form one complementarity problem, either at
//! acceleration level, with a term that corrects the gap (Baumgarte), or at the level of the
//! velocities after the step, without that term:
//!
//! ```text
//! 0 ≤ λ ⊥ g̈ + v ġ + K g ≥ 0          0 ≤ λ ⊥ (ġ + e ġ)/h + J a ≥ 0        a = f(λ): linear
//! ```
//!
//! The second form includes impacts: λh is an impulse where the gap was closing. Its rate at the
//! end, ġ⁺ = ġ + h J a, leaves the curvature of the constraint to the next step.

use twinrig_contact::{Method, Problem, SolveError};

use super::Instant;
use super::closed::{STICKING, touching};
use super::entry::{Entry, Feet, Role, Stop};
use super::impact::RESTING;
use super::losses::Losses;
use super::resolve_modes::motors_only;
use crate::constraints::mode::Mode;
use crate::constraints::motion::{Dynamics, Motion};
use crate::model::articulated::Articulated;
use crate::model::leg_constraints::{CABLE, DriveAction};
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Level at which closed constraints are imposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ConstraintLevel {
    /// Accelerations that correct gap and rate: K \[1/s²\] and v \[1/s\].
    Acceleration { stiffness: f64, damping: f64 },
    /// Velocities that close no gap after a step of this length \[s\].
    Velocity { seconds: f64 },
}

/// Motion and constraint forces at the start of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constrained<const N: usize> {
    /// Right-hand side including constraint forces; its powers exclude those of the constraints.
    pub(crate) motion: Motion<Lanes, N>,
    /// Work of impulses and of friction on the ground, by the mean of the rates before and after
    /// the step \[J\]. At acceleration level there are no impulses, and only sliding feet
    /// contribute.
    pub(crate) impact: f64,
    pub(crate) friction: f64,
    /// Ground forces on each leg, world frame \[N\].
    pub(crate) ground: [[f64; 3]; 4],
}

impl<const N: usize> Instant<N> {
    /// Computes the forces of all closed constraints in a state and stores the active ones in the
    /// mode, for a step of `seconds`.
    pub(crate) fn constrain(
        &mut self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        level: ConstraintLevel,
        method: Method,
        seconds: f64,
        mode: &mut Mode,
    ) -> Result<Constrained<N>, SolveError> {
        let (articulated, drive) = motors_only(dynamics, state);
        let mut legs = [0, 1, 2, 3];
        let legs = &mut legs[..dynamics.model.legs.len()];
        let feet = match level {
            ConstraintLevel::Acceleration { .. } => Feet::BySpeed,
            ConstraintLevel::Velocity { .. } => Feet::WithTangents,
        };
        self.find_entries(dynamics, state, &articulated, &drive, legs, feet, &touching);
        mode.deactivate();
        if !self.entries.is_empty() {
            let restitution = dynamics.model.restitution();
            let friction = &dynamics.model.friction;
            self.prepare(&articulated, friction);
            self.set_offsets(&articulated, level, restitution);
            // Errors of the rates below the sticking speed are accepted.
            self.solve(STICKING / seconds, method, Problem::solve_by)?;
            self.mark_active(mode, friction, 0.0);
        }
        mode.update_any();
        Ok(self.constrained(dynamics, state, articulated, drive, level, seconds))
    }

    /// Sets the offsets of the problem.
    fn set_offsets(
        &mut self,
        articulated: &Articulated<Lanes, N>,
        level: ConstraintLevel,
        restitution: f64,
    ) {
        let free = articulated.accelerations();
        for (i, entry) in self.entries.iter().enumerate() {
            let mut offset = entry.winding;
            for (j, a) in entry.row.trunk.iter().zip(&free.trunk) {
                offset += j * a;
            }
            for (j, a) in entry.row.links.iter().zip(&free.links) {
                offset += j * a.lane(entry.row.leg);
            }
            offset += match level {
                ConstraintLevel::Acceleration { stiffness, damping } => match entry.role {
                    // The position at which a foot sticks is not stored: only its rate is
                    // corrected.
                    Role::Tangent { .. } => entry.bias + 0.5 * damping * entry.rate,
                    _ => entry.bias + damping * entry.rate + stiffness * entry.gap,
                },
                ConstraintLevel::Velocity { seconds } => {
                    (1.0 + entry.effective_restitution(restitution)) * entry.rate / seconds
                }
            };
            self.problem.offset(i, offset);
        }
    }

    /// Computes motion and losses under the forces of the solution.
    fn constrained(
        &self,
        dynamics: &Dynamics<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: Articulated<Lanes, N>,
        drive: DriveAction<Lanes>,
        level: ConstraintLevel,
        seconds: f64,
    ) -> Constrained<N> {
        let mut accelerations = articulated.accelerations();
        let (mut trunk, mut torques) = (accelerations.trunk, articulated.torques);
        let mut losses = Losses::default();
        if let ConstraintLevel::Velocity { .. } = level {
            let restitution = dynamics
                .model
                .ground
                .as_ref()
                .map_or(0.0, |g| g.restitution);
            losses = self.losses(seconds, |row| {
                let entry = &self.entries[row];
                seconds * self.problem.w(row)
                    - entry.effective_restitution(restitution) * entry.rate
            });
        }
        let mut cable = Lanes::zero();
        for (i, entry) in self.entries.iter().enumerate() {
            let force = self.problem.unknowns()[i];
            for (a, r) in trunk.iter_mut().zip(&self.force_responses[i].trunk) {
                *a += r * force;
            }
            let leg = entry.row.leg;
            for (torque, arm) in torques.iter_mut().zip(&entry.force_row.links) {
                *torque = torque.with_lane(leg, torque.lane(leg) + arm * force);
            }
            if entry.role == Role::Stop(Stop::Cable) {
                cable = cable.with_lane(leg, force);
            }
        }
        if !self.entries.is_empty() {
            accelerations = articulated.with_trunk(trunk, &torques);
        }
        let mut forces = dynamics.leg_forces(&articulated, &accelerations, &drive);
        forces.forces[CABLE] = cable;
        let radius = dynamics.legs.pulley_radius;
        let saturated = dynamics.commands.pulley_saturated;
        forces.knee_torque += (Lanes::splat(1.0) - saturated * saturated) * radius * cable;
        let slope = dynamics.slope(state, &articulated, &accelerations, &drive, &forces);
        let sliding_power = self.sliding_power(state);
        Constrained {
            motion: Motion {
                slope,
                forces,
                articulated,
                drive,
            },
            impact: losses.impact,
            friction: losses.friction + seconds * sliding_power,
            ground: self.ground(),
        }
    }

    /// Returns the power of friction on sliding feet \[W\].
    fn sliding_power(&self, state: &State<Lanes, N>) -> f64 {
        let mut power = 0.0;
        for (entry, force) in self.entries.iter().zip(self.problem.unknowns()) {
            if !matches!(
                entry.role,
                Role::Normal {
                    slides: Some(_),
                    ..
                }
            ) {
                continue;
            }
            // Velocity along the direction of force, minus the normal part.
            let mut along = -entry.rate;
            let twist = state.velocity.iter().chain(&state.turning);
            for (j, u) in entry.force_row.trunk.iter().zip(twist) {
                along += j * u;
            }
            for (j, rate) in entry.force_row.links.iter().zip(&state.rates) {
                along += j * rate.lane(entry.row.leg);
            }
            power -= force * along;
        }
        power
    }
}

impl<const N: usize> Entry<N> {
    /// Returns the coefficient of restitution at this rate.
    fn effective_restitution(&self, restitution: f64) -> f64 {
        match self.role {
            Role::Normal { .. } if self.rate < -RESTING => restitution,
            _ => 0.0,
        }
    }
}
