//! Forces of closed constraints over a step of fixed length, in which no event is looked for.
//!
//! What is found closed when the step begins is one complementarity problem, either of accelerations, with a term that takes
//! back what the gap has become (Baumgarte), or of the velocities after the step, without one:
//!
//! ```text
//! 0 ≤ λ ⊥ g̈ + v ġ + K g ≥ 0          0 ≤ λ ⊥ (ġ + e ġ)/h + J a ≥ 0        a = f(λ): linear
//! ```
//!
//! The second has impacts in it: λh is an impulse where the gap was closing. Its rate at the end, ġ⁺ = ġ + h J a, leaves the
//! curvature of the constraint to the next step.

use twinrig_contact::{Method, Problem, Unsolved};

use super::Instant;
use super::closed::{Entry, Feet, HOLDING, Role, Stop, touching};
use super::impact::RESTING;
use super::losses::Losses;
use super::resolve_modes::motors_only;
use crate::articulated::Articulated;
use crate::constraints::{CABLE, Driven};
use crate::mode::Mode;
use crate::motion::{Motion, Scene};
use crate::real::{Lanes, Real};
use crate::state::State;

/// What is demanded of closed constraints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Demand {
    /// Accelerations that take back gap and rate: K \[1/s²\] and v \[1/s\].
    Acceleration { stiffness: f64, damping: f64 },
    /// Velocities that close no gap after a step of this length \[s\].
    Velocity { seconds: f64 },
}

/// How a step begins, and what constraints do in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constrained<const N: usize> {
    /// The right-hand side with the constraints' forces in it; their own power is not among its powers.
    pub(crate) motion: Motion<Lanes, N>,
    /// Work that impulses and friction on the ground took, by the mean of the rates before and after the step \[J\]. At the
    /// level of accelerations there are no impulses, and only feet that slide are seen.
    pub(crate) impact: f64,
    pub(crate) friction: f64,
    /// Forces of the ground on each leg, world frame \[N\].
    pub(crate) ground: [[f64; 3]; 4],
}

impl<const N: usize> Instant<N> {
    /// Forces of all that is closed in a state; which of them push is noted in the mode. A step of `seconds` follows.
    pub(crate) fn constrain(
        &mut self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        demand: Demand,
        method: Method,
        seconds: f64,
        mode: &mut Mode,
    ) -> Result<Constrained<N>, Unsolved> {
        let (articulated, drive) = motors_only(scene, state);
        let mut legs = [0, 1, 2, 3];
        let legs = &mut legs[..scene.model.legs.len()];
        let feet = match demand {
            Demand::Acceleration { .. } => Feet::BySpeed,
            Demand::Velocity { .. } => Feet::Held,
        };
        self.find(scene, state, &articulated, &drive, legs, feet, &touching);
        mode.release();
        if !self.entries.is_empty() {
            let (friction, restitution) = scene
                .model
                .ground
                .as_ref()
                .map_or((0.0, 0.0), |ground| (ground.friction, ground.restitution));
            self.prepare(&articulated, friction);
            self.demand(&articulated, demand, restitution);
            // Rates that are wrong by less than what counts as holding are not wrong.
            self.solve(HOLDING / seconds, method, Problem::solve_by)?;
            self.note(mode, friction, 0.0);
        }
        mode.recount();
        Ok(self.constrained(scene, state, articulated, drive, demand, seconds))
    }

    /// Fills in the problem's offsets.
    fn demand(&mut self, articulated: &Articulated<Lanes, N>, demand: Demand, restitution: f64) {
        let free = articulated.accelerations();
        for (i, entry) in self.entries.iter().enumerate() {
            let mut offset = entry.winding;
            for (j, a) in entry.row.trunk.iter().zip(&free.trunk) {
                offset += j * a;
            }
            for (j, a) in entry.row.links.iter().zip(&free.links) {
                offset += j * a.lane(entry.row.leg);
            }
            offset += match demand {
                Demand::Acceleration { stiffness, damping } => match entry.role {
                    // Where a foot holds is not remembered: only its rate is taken back.
                    Role::Tangent { .. } => entry.bias + 0.5 * damping * entry.rate,
                    _ => entry.bias + damping * entry.rate + stiffness * entry.gap,
                },
                Demand::Velocity { seconds } => {
                    (1.0 + entry.returned(restitution)) * entry.rate / seconds
                }
            };
            self.problem.offset(i, offset);
        }
    }

    /// What the forces that were found do.
    fn constrained(
        &self,
        scene: &Scene<'_, Lanes, N>,
        state: &State<Lanes, N>,
        articulated: Articulated<Lanes, N>,
        drive: Driven<Lanes>,
        demand: Demand,
        seconds: f64,
    ) -> Constrained<N> {
        let mut accelerations = articulated.accelerations();
        let (mut trunk, mut torques) = (accelerations.trunk, articulated.torques);
        let mut losses = Losses::default();
        if let Demand::Velocity { .. } = demand {
            let restitution = scene.model.ground.as_ref().map_or(0.0, |g| g.restitution);
            losses = self.losses(seconds, |row| {
                let entry = &self.entries[row];
                seconds * self.problem.w(row) - entry.returned(restitution) * entry.rate
            });
        }
        let mut cable = Lanes::zero();
        for (i, entry) in self.entries.iter().enumerate() {
            let force = self.problem.unknowns()[i];
            for (a, r) in trunk.iter_mut().zip(&self.pushes[i].trunk) {
                *a += r * force;
            }
            let leg = entry.row.leg;
            for (torque, arm) in torques.iter_mut().zip(&entry.push.links) {
                *torque = torque.with_lane(leg, torque.lane(leg) + arm * force);
            }
            if entry.role == Role::Stop(Stop::Cable) {
                cable = cable.with_lane(leg, force);
            }
        }
        if !self.entries.is_empty() {
            accelerations = articulated.with_trunk(trunk, &torques);
        }
        let mut forces = scene.feel(&articulated, &accelerations, &drive);
        forces.forces[CABLE] = cable;
        let radius = scene.legs.pulley_radius;
        let saturated = scene.commands.pulley_saturated;
        forces.knee_torque += (Lanes::splat(1.0) - saturated * saturated) * radius * cable;
        let slope = scene.slope(state, &articulated, &accelerations, &drive, &forces);
        let slid = self.slid(state);
        Constrained {
            motion: Motion {
                slope,
                forces,
                articulated,
                drive,
            },
            impact: losses.impact,
            friction: losses.friction + seconds * slid,
            ground: self.ground(),
        }
    }

    /// The power of friction on feet that are known to slide \[W\].
    fn slid(&self, state: &State<Lanes, N>) -> f64 {
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
            // What they are pushed along, less the normal.
            let mut along = -entry.rate;
            let twist = state.velocity.iter().chain(&state.turning);
            for (j, u) in entry.push.trunk.iter().zip(twist) {
                along += j * u;
            }
            for (j, rate) in entry.push.links.iter().zip(&state.rates) {
                along += j * rate.lane(entry.row.leg);
            }
            power -= force * along;
        }
        power
    }
}

impl<const N: usize> Entry<N> {
    /// Share of its rate that a gap gets back.
    fn returned(&self, restitution: f64) -> f64 {
        match self.role {
            Role::Normal { .. } if self.rate < -RESTING => restitution,
            _ => 0.0,
        }
    }
}
