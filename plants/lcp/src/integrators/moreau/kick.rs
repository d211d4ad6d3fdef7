//! Forces of a step in its middle, without those of the constraints.
//!
//! ```text
//! (H(q̄) + τD)(u_b − u_a) = h f(q̄, u_a) + τ (g(u_a) + g⁻(u_b)) + JᵀP        τ = ½h
//! ```
//!
//! g is the change of momenta by inertia along curved paths: ∂T/∂θ of links, Π × ω for the trunk.
//! At `u_b` it is found by iteration with constant H, and therefore constant factorisations. During
//! the iteration the constraint forces are those of the previous step; afterwards they are solved
//! for.

use twinrig_robot::GRAVITY;

use crate::constraints::events::{Entry, Instant, Role, SLOTS, Stop};
use crate::integrators::step_error::StepError;
use crate::model::Model;
use crate::model::articulated::{Accelerations, Articulated};
use crate::model::load::PushForces;
use crate::model::real::{Lanes, Real};
use crate::model::trunk::{Spatial, cross, reduced};

use super::drift::{ITERATIONS_MAX, Rates, converged, transported};
use super::momentum::{Geometry, Momenta};

/// Generalised force on trunk and links.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load<const N: usize> {
    trunk: Spatial<f64>,
    links: [Lanes; N],
}

impl<const N: usize> Instant<N> {
    /// Returns the load of forces along closed constraints, by leg and slot.
    pub(super) fn load(&self, forces: &[[f64; SLOTS]; 4]) -> Load<N> {
        let force_of = |entry: &Entry<N>| forces[entry.row.leg][entry.role.slot()];
        let mut load = Load {
            trunk: [0.0; 6],
            links: [Lanes::zero(); N],
        };
        for entry in &self.entries {
            let (leg, force) = (entry.row.leg, force_of(entry));
            if force == 0.0 {
                continue;
            }
            for (sum, arm) in load.trunk.iter_mut().zip(&entry.row.trunk) {
                *sum += arm * force;
            }
            for (sum, arm) in load.links.iter_mut().zip(&entry.row.links) {
                *sum = sum.with_lane(leg, sum.lane(leg) + arm * force);
            }
        }
        load
    }

    /// Returns the sum of the impulses on trunk and legs, trunk axes.
    pub(super) fn wrench(&self) -> Spatial<f64> {
        let mut sum = [0.0; 6];
        for (entry, impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            for (sum, arm) in sum.iter_mut().zip(&entry.row.trunk) {
                *sum += arm * impulse;
            }
        }
        sum
    }

    /// Returns the tension of each leg's cable by impulses over `seconds` \[N\].
    pub(super) fn tension(&self, seconds: f64) -> Lanes {
        let mut tension = Lanes::zero();
        for (entry, impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            if entry.role == Role::Stop(Stop::Cable) {
                tension = tension.with_lane(entry.row.leg, impulse / seconds);
            }
        }
        tension
    }
}

/// Forces in the middle of a step (the kick of the leapfrog).
pub(super) struct Kick<'a, const N: usize> {
    pub(super) model: &'a Model<N>,
    pub(super) geometry: &'a Geometry<N>,
    /// Torque of hip motors that impose no acceleration.
    pub(super) hip_torque: Lanes,
    /// Rates before the impulses, `u_a`.
    pub(super) rates: &'a Rates<N>,
    /// Momenta at these rates.
    pub(super) before: &'a Momenta<N>,
    /// Generalised forces of pushes, if any.
    pub(super) pushed: Option<&'a PushForces<Lanes, N>>,
    pub(super) seconds: f64,
}

impl<const N: usize> Kick<'_, N> {
    /// Sets the forces in the middle of the step, for a mean that includes this load.
    pub(super) fn apply(
        &self,
        articulated: &mut Articulated<Lanes, N>,
        load: &Load<N>,
    ) -> Result<(), StepError> {
        let legs = &self.model.side_by_side;
        let (h, half) = (Lanes::splat(self.seconds), Lanes::splat(0.5));
        let free = self.model.is_free();
        let before = self.before;
        let turn_before = self.gyroscopic(before.spin, self.rates.turning, -1.0);
        let weight = articulated
            .base
            .as_ref()
            .map_or([0.0, 0.0, -GRAVITY], |base| {
                std::array::from_fn(|i| -GRAVITY * base.rotation[2][i])
            });
        let noninertial = self.noninertial(articulated, weight);
        let (mut gradients, mut turns) = (before.gradients, turn_before);
        // Half of the given g added: g(u_a), and after the iteration g(u_a) + g(u_b).
        let half_before = |gradients: &[Lanes; N], turn: [f64; 3]| {
            let links = std::array::from_fn(|i| noninertial.links[i] + half * gradients[i]);
            (links, turn.map(|turn| 0.5 * turn))
        };
        let (links, turn) = half_before(&before.gradients, turn_before);
        let explicit = articulated.accelerations_under(&noninertial.trunk, &links, turn, load);
        let mut last = *self.rates;
        for iteration in 0..ITERATIONS_MAX {
            let more = articulated.rate_changes(&gradients, turns);
            let next = Rates {
                links: std::array::from_fn(|i| {
                    self.rates.links[i] + h * (explicit.links[i] + half * more.links[i])
                }),
                turning: std::array::from_fn(|i| {
                    let rate = explicit.trunk[3 + i] + 0.5 * more.turning[i];
                    self.rates.turning[i] + self.seconds * rate
                }),
            };
            let (mut change, mut size) = (Lanes::zero(), Lanes::zero());
            for (next, last) in next.links.iter().zip(&last.links) {
                change += (*next - *last).abs();
                size += next.abs();
            }
            let mut turn = [0.0; 2];
            for (next, last) in next.turning.iter().zip(&last.turning) {
                turn[0] += (next - last).abs();
                turn[1] += next.abs();
            }
            let done = converged(free, change, size, turn, self.seconds)?;
            if iteration > 0 && done.all() {
                let links: [Lanes; N] = std::array::from_fn(|i| before.gradients[i] + gradients[i]);
                let (links, turn) =
                    half_before(&links, std::array::from_fn(|i| turn_before[i] + turns[i]));
                articulated.set_forces(&noninertial.trunk, links, turn);
                return Ok(());
            }
            let after = self.geometry.momenta(legs, &next.links, next.turning);
            for i in 0..N {
                // Independent legs converge separately.
                let keep = if iteration > 0 { done } else { Lanes::zero() };
                gradients[i] = keep.bitselect(gradients[i], after.gradients[i]);
            }
            turns = self.gyroscopic(after.spin, next.turning, 1.0);
            last = next;
        }
        let seconds = self.seconds;
        Err(StepError::NotConverged { seconds })
    }

    /// Returns the gyroscopic change of Π in trunk axes: (Π − T(±τω) Π)/τ.
    fn gyroscopic(&self, spin: [f64; 3], turning: [f64; 3], sign: f64) -> [f64; 3] {
        let half = 0.5 * self.seconds;
        let after = transported(turning.map(|rate| sign * half * rate), spin);
        std::array::from_fn(|i| sign * (spin[i] - after[i]) / half)
    }

    /// Returns the forces other than inertia: gravity, springs, friction, motors, pushes.
    #[inline(always)]
    fn noninertial(&self, articulated: &Articulated<Lanes, N>, weight: [f64; 3]) -> Load<N> {
        let legs = &self.model.side_by_side;
        let chain = &articulated.chain;
        let [forward, _, up] = weight.map(Lanes::splat);
        let mut load = Load {
            trunk: [0.0; 6],
            links: std::array::from_fn(|j| {
                let falls = chain.cosines[j] * forward + chain.sines[j] * up;
                chain.springs[j] + chain.friction[j] + legs.moments[j] * falls
            }),
        };
        load.links[0] += self.hip_torque;
        if let Some(base) = &articulated.base {
            let turn = cross(base.trunk.moment, weight);
            for i in 0..3 {
                load.trunk[i] = self.model.trunk.mass * weight[i];
                load.trunk[3 + i] = turn[i];
            }
        }
        if let Some(pushed) = self.pushed {
            for (sum, force) in load.trunk.iter_mut().zip(pushed.trunk) {
                *sum += force;
            }
            for (sum, torque) in load.links.iter_mut().zip(pushed.links) {
                *sum += torque;
            }
        }
        load
    }
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Sets the forces on the trunk and on the links, and additional torques on the trunk.
    #[inline(always)]
    fn set_forces(&mut self, trunk: &Spatial<f64>, links: [Lanes; N], turn: [f64; 3]) {
        self.torques = links;
        if let Some(base) = &mut self.base {
            base.trunk.force = *trunk;
            for (sum, turn) in base.trunk.force[3..].iter_mut().zip(turn) {
                *sum += turn;
            }
            let relative = self.mobility.accelerations(&self.torques);
            base.schur.force = reduced(base.trunk.force, &base.coupling, &relative);
        }
    }

    /// Returns the accelerations under these forces and a load.
    #[inline(always)]
    fn accelerations_under(
        &self,
        trunk: &Spatial<f64>,
        links: &[Lanes; N],
        turn: [f64; 3],
        load: &Load<N>,
    ) -> Accelerations<Lanes, N> {
        let torques: [Lanes; N] = std::array::from_fn(|i| links[i] + load.links[i]);
        let trunk = self.base.as_ref().map_or([0.0; 6], |base| {
            let mut force: Spatial<f64> = std::array::from_fn(|i| trunk[i] + load.trunk[i]);
            for (sum, turn) in force[3..].iter_mut().zip(turn) {
                *sum += turn;
            }
            let relative = self.mobility.accelerations(&torques);
            base.schur.solve(reduced(force, &base.coupling, &relative))
        });
        self.with_trunk(trunk, &torques)
    }
}
