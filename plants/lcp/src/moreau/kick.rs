//! The forces of a step but those of the constraints, all in its middle.
//!
//! ```text
//! (H(q̄) + τD)(u_b − u_a) = h f(q̄, u_a) + τ (g(u_a) + g⁻(u_b)) + JᵀP        τ = ½h
//! ```
//!
//! g is what the momenta of masses on curved paths change by: ∂T/∂θ of links, Π × ω for the trunk.
//! At `u_b` it is found by iteration, in which H, and so every factorisation, stays as it is. Forces
//! of constraints are those of the step before while it is looked for, and found once it is known.

use twinrig_robot::GRAVITY;

use crate::articulated::{Accelerations, Articulated};
use crate::events::{Entry, Instant, PLACES};
use crate::flow::FlowError;
use crate::model::Model;
use crate::real::{Lanes, Real};
use crate::trunk::{Spatial, cross, reduced};

use super::drift::{ESTIMATES_MAX, Rates, settled, transported};
use super::momentum::{Geometry, Momenta};

/// A generalised force on trunk and links.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load<const N: usize> {
    trunk: Spatial<f64>,
    links: [Lanes; N],
}

impl<const N: usize> Instant<N> {
    /// Load of forces along what is closed, by leg and place.
    pub(super) fn load(&self, forces: &[[f64; PLACES]; 4]) -> Load<N> {
        let force_of = |entry: &Entry<N>| forces[entry.row.leg][entry.role.place()];
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

    /// Impulses on the trunk and what it carries, trunk axes.
    pub(super) fn wrench(&self) -> Spatial<f64> {
        let mut sum = [0.0; 6];
        for (entry, impulse) in self.entries.iter().zip(self.problem.unknowns()) {
            for (sum, arm) in sum.iter_mut().zip(&entry.row.trunk) {
                *sum += arm * impulse;
            }
        }
        sum
    }
}

/// A step whose forces are being found.
pub(super) struct Kick<'a, const N: usize> {
    pub(super) model: &'a Model<N>,
    pub(super) geometry: &'a Geometry<N>,
    /// Torque of hip motors that impose no acceleration.
    pub(super) hip_torque: Lanes,
    /// Rates before the impulses, `u_a`.
    pub(super) rates: &'a Rates<N>,
    /// Momenta at them.
    pub(super) before: &'a Momenta<N>,
    pub(super) seconds: f64,
}

impl<const N: usize> Kick<'_, N> {
    /// Puts the forces on a robot in the middle of the step, for a mean that this load is part of.
    pub(super) fn load(
        &self,
        articulated: &mut Articulated<Lanes, N>,
        load: &Load<N>,
    ) -> Result<(), FlowError> {
        let legs = &self.model.side_by_side;
        let (h, half) = (Lanes::splat(self.seconds), Lanes::splat(0.5));
        let free = self.model.is_free();
        let before = self.before;
        let turned = self.gyration(before.spin, self.rates.turning, -1.0);
        let weight = articulated
            .base
            .as_ref()
            .map_or([0.0, 0.0, -GRAVITY], |base| {
                std::array::from_fn(|i| -GRAVITY * base.rotation[2][i])
            });
        let still = self.still(articulated, weight);
        let (mut pushes, mut turns) = (before.pushes, turned);
        // All but g(u_b), and that as far as it is known.
        let half_before = |pushes: &[Lanes; N], turn: [f64; 3]| {
            let links = std::array::from_fn(|i| still.links[i] + half * pushes[i]);
            (links, turn.map(|turn| 0.5 * turn))
        };
        let (links, turn) = half_before(&before.pushes, turned);
        let known = articulated.under(&still.trunk, &links, turn, load);
        let mut last = *self.rates;
        for estimate in 0..ESTIMATES_MAX {
            let more = articulated.yielded(&pushes, turns);
            let next = Rates {
                links: std::array::from_fn(|i| {
                    self.rates.links[i] + h * (known.links[i] + half * more.links[i])
                }),
                turning: std::array::from_fn(|i| {
                    let turned = known.trunk[3 + i] + 0.5 * more.turning[i];
                    self.rates.turning[i] + self.seconds * turned
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
            let done = settled(free, change, size, turn, self.seconds)?;
            if estimate > 0 && done.all() {
                let links: [Lanes; N] = std::array::from_fn(|i| before.pushes[i] + pushes[i]);
                let (links, turn) =
                    half_before(&links, std::array::from_fn(|i| turned[i] + turns[i]));
                articulated.take(&still.trunk, links, turn);
                return Ok(());
            }
            let after = self.geometry.momenta(legs, &next.links, next.turning);
            for i in 0..N {
                // Legs that have nothing to do with each other do not wait for each other.
                let keep = if estimate > 0 { done } else { Lanes::zero() };
                pushes[i] = keep.bitselect(pushes[i], after.pushes[i]);
            }
            turns = self.gyration(after.spin, next.turning, 1.0);
            last = next;
        }
        let seconds = self.seconds;
        Err(FlowError::Unsettled { seconds })
    }

    /// What turns Π in trunk axes: (Π − T(±τω) Π)/τ.
    fn gyration(&self, spin: [f64; 3], turning: [f64; 3], sign: f64) -> [f64; 3] {
        let half = 0.5 * self.seconds;
        let after = transported(turning.map(|rate| sign * half * rate), spin);
        std::array::from_fn(|i| sign * (spin[i] - after[i]) / half)
    }

    /// Forces but those of inertia: gravity, springs, friction, motors.
    #[inline(always)]
    fn still(&self, articulated: &Articulated<Lanes, N>, weight: [f64; 3]) -> Load<N> {
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
        load
    }
}

impl<const N: usize> Articulated<Lanes, N> {
    /// Takes these forces: on the trunk, on the links, and torques on the trunk besides.
    #[inline(always)]
    fn take(&mut self, trunk: &Spatial<f64>, links: [Lanes; N], turn: [f64; 3]) {
        self.torques = links;
        if let Some(base) = &mut self.base {
            base.trunk.force = *trunk;
            for (sum, own) in base.trunk.force[3..].iter_mut().zip(turn) {
                *sum += own;
            }
            let relative = self.give.accelerations(&self.torques);
            base.schur.force = reduced(base.trunk.force, &base.carried, &relative);
        }
    }

    /// Accelerations under these forces and a load.
    #[inline(always)]
    fn under(
        &self,
        trunk: &Spatial<f64>,
        links: &[Lanes; N],
        turn: [f64; 3],
        load: &Load<N>,
    ) -> Accelerations<Lanes, N> {
        let torques: [Lanes; N] = std::array::from_fn(|i| links[i] + load.links[i]);
        let trunk = self.base.as_ref().map_or([0.0; 6], |base| {
            let mut force: Spatial<f64> = std::array::from_fn(|i| trunk[i] + load.trunk[i]);
            for (sum, own) in force[3..].iter_mut().zip(turn) {
                *sum += own;
            }
            let relative = self.give.accelerations(&torques);
            base.schur.solve(reduced(force, &base.carried, &relative))
        });
        self.with_trunk(trunk, &torques)
    }
}
