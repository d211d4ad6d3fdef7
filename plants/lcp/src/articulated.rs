//! Trunk and legs in one state, and how they answer to forces.

use crate::carried::{COUPLED, Carried, Carrier};
use crate::chain::Chain;
use crate::constants::Constants;
use crate::constraints::{ConstraintSet, Give};
use crate::model::Model;
use crate::real::Real;
use crate::state::State;
use crate::trunk::{Schur, Spatial, Trunk, cross, summed};
use twinrig_robot::GRAVITY;

/// Rotation from trunk to world.
pub(crate) type Rotation<T> = [[T; 3]; 3];

/// Trunk and legs in one state, with what holds inside the legs taken out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Articulated<R: Real, const N: usize> {
    pub(crate) chain: Chain<R, N>,
    pub(crate) give: Give<R, N>,
    /// Torques on the links: springs, friction, gravity, velocities, motors that are used up.
    pub(crate) torques: [R; N],
    /// What a trunk that moves adds.
    pub(crate) base: Option<Floating<R, N>>,
}

/// A trunk that moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Floating<R: Real, const N: usize> {
    pub(crate) carried: Carried<R, N>,
    pub(crate) trunk: Trunk<R::Sum>,
    pub(crate) schur: Schur<R::Sum>,
    pub(crate) rotation: Rotation<R::Sum>,
}

/// Accelerations of everything.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Accelerations<R: Real, const N: usize> {
    pub(crate) trunk: Spatial<R::Sum>,
    pub(crate) links: [R; N],
    /// Torques that the legs' own equations see: all but the forces of what holds inside them.
    pub(crate) torques: [R; N],
}

/// A direction in which something may be pushed: a gap's gradient, by the trunk's and one leg's velocities.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<T, const N: usize> {
    pub(crate) leg: usize,
    pub(crate) trunk: Spatial<T>,
    pub(crate) links: [T; N],
}

/// What a unit force along a row does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Response<T, const N: usize> {
    /// Φ Jᵀ: of the links, with the trunk held.
    pub(crate) links: [T; N],
    /// What of it reaches the trunk, w = Jₜ − C Φ Jᵀ, and S⁻¹ w.
    pub(crate) pull: Spatial<T>,
    pub(crate) trunk: Spatial<T>,
}

/// The rotation of a quaternion that need not have unit length.
#[inline(always)]
pub(crate) fn rotation<T: Real>([w, x, y, z]: [T; 4]) -> Rotation<T> {
    let one = T::splat(1.0);
    let two = T::splat(2.0) / (w * w + x * x + y * y + z * z);
    let (wx, wy, wz) = (two * w * x, two * w * y, two * w * z);
    let (xx, yy, zz) = (two * x * x, two * y * y, two * z * z);
    let (xy, xz, yz) = (two * x * y, two * x * z, two * y * z);
    [
        [one - (yy + zz), xy - wz, xz + wy],
        [xy + wz, one - (xx + zz), yz - wx],
        [xz - wy, yz + wx, one - (xx + yy)],
    ]
}

/// A vector of the world in trunk axes.
#[inline(always)]
pub(crate) fn into_trunk<T: Real>(rotation: &Rotation<T>, world: [T; 3]) -> [T; 3] {
    std::array::from_fn(|i| {
        rotation[0][i] * world[0] + rotation[1][i] * world[1] + rotation[2][i] * world[2]
    })
}

/// A vector in trunk axes, in those of the world.
#[inline(always)]
pub(crate) fn into_world<T: Real>(rotation: &Rotation<T>, own: [T; 3]) -> [T; 3] {
    rotation.map(|row| row[0] * own[0] + row[1] * own[1] + row[2] * own[2])
}

/// How fast a unit force along one row moves another: `pushed` is what it does, `pull` what a unit force along the other
/// brings to the trunk.
#[inline(always)]
pub(crate) fn between<T: Real, const N: usize>(
    row: &Row<T, N>,
    pull: &Spatial<T>,
    other: &Row<T, N>,
    pushed: &Response<T, N>,
) -> T {
    let mut sum = T::zero();
    for i in 0..6 {
        sum += pull[i] * pushed.trunk[i];
    }
    between_links(sum, row, other, pushed)
}

/// The same where the trunk's part of it is known.
#[inline(always)]
pub(crate) fn between_links<T: Real, const N: usize>(
    mut sum: T,
    row: &Row<T, N>,
    other: &Row<T, N>,
    pushed: &Response<T, N>,
) -> T {
    if row.leg == other.leg {
        for i in 0..N {
            sum += row.links[i] * pushed.links[i];
        }
    }
    sum
}

impl<R: Real, const N: usize> Floating<R, N> {
    #[inline(always)]
    fn new(
        model: &Model<N>,
        legs: &Constants<R, N>,
        state: &State<R, N>,
        constraint_set: &ConstraintSet<'_, R>,
        chain: &Chain<R, N>,
        give: &Give<R, N>,
    ) -> Self {
        let none = <R::Sum as Real>::zero();
        let rotation = rotation(state.attitude);
        let weight = into_trunk(&rotation, [none, none, <R::Sum as Real>::splat(-GRAVITY)]);
        let turned = cross(state.turning, state.velocity);
        let field = std::array::from_fn(|i| weight[i] - turned[i]);
        let carrier = Carrier {
            turning: state.turning.map(R::broadcast),
            field: field.map(R::broadcast),
        };
        let mut carried = Carried::new(legs, chain, &carrier);
        carried.torques[0] += constraint_set.drive.hip_torque;
        let trunk = Trunk::new(&model.trunk, &summed(&carried.burden), state.turning, field);
        let schur = Schur::new(&model.trunk, &trunk, &carried, give);
        Self {
            carried,
            trunk,
            schur,
            rotation,
        }
    }
}

impl<R: Real, const N: usize> Articulated<R, N> {
    #[inline(always)]
    pub(crate) fn new(
        model: &Model<N>,
        legs: &Constants<R, N>,
        state: &State<R, N>,
        constraint_set: &ConstraintSet<'_, R>,
    ) -> Self {
        let (chain, give, torques);
        let mut base = None;
        if model.is_free() {
            chain = Chain::new(legs, &state.angles, &state.rates);
            give = chain.give(legs, &state.angles, constraint_set);
            let floating = Floating::new(model, legs, state, constraint_set, &chain, &give);
            torques = floating.carried.torques;
            base = Some(floating);
        } else {
            (chain, give, torques) = Self::legs(legs, state, constraint_set);
        }
        Self {
            chain,
            give,
            torques,
            base,
        }
    }

    /// Room for one.
    #[inline(always)]
    pub(crate) fn blank() -> Self {
        Self {
            chain: Chain::blank(),
            give: Give::blank(),
            torques: [R::zero(); N],
            base: None,
        }
    }

    /// Another state in its place: what is large is not moved about.
    #[inline(always)]
    pub(crate) fn renew(
        &mut self,
        model: &Model<N>,
        legs: &Constants<R, N>,
        state: &State<R, N>,
        constraint_set: &ConstraintSet<'_, R>,
    ) {
        if !model.is_free() {
            (self.chain, self.give, self.torques) = Self::legs(legs, state, constraint_set);
            self.base = None;
            return;
        }
        self.chain = Chain::new(legs, &state.angles, &state.rates);
        self.give = self.chain.give(legs, &state.angles, constraint_set);
        let base = Floating::new(model, legs, state, constraint_set, &self.chain, &self.give);
        self.torques = base.carried.torques;
        self.base = Some(base);
    }

    /// The inertia in another state in its place: nothing pushes, and the trunk stands as the world.
    #[inline(always)]
    pub(crate) fn unload(
        &mut self,
        model: &Model<N>,
        legs: &Constants<R, N>,
        [angles, rates]: [&[R; N]; 2],
        constraint_set: &ConstraintSet<'_, R>,
    ) {
        self.chain = Chain::new(legs, angles, rates);
        self.give = self.chain.give(legs, angles, constraint_set);
        self.torques = [R::zero(); N];
        if !model.is_free() {
            self.base = None;
            return;
        }
        let carried = Carried::unloaded(legs, &self.chain);
        let trunk = Trunk::unloaded(&model.trunk, &summed(&carried.burden));
        let schur = Schur::with(&model.trunk, &trunk, &carried, &self.give, trunk.force);
        let (none, one) = (<R::Sum as Real>::zero(), <R::Sum as Real>::splat(1.0));
        self.base = Some(Floating {
            carried,
            trunk,
            schur,
            rotation: [[one, none, none], [none, one, none], [none, none, one]],
        });
    }

    /// Legs on a trunk that is held, and the torques on their links.
    #[inline(always)]
    pub(crate) fn legs(
        legs: &Constants<R, N>,
        state: &State<R, N>,
        constraint_set: &ConstraintSet<'_, R>,
    ) -> (Chain<R, N>, Give<R, N>, [R; N]) {
        let chain = Chain::new(legs, &state.angles, &state.rates);
        let give = chain.give(legs, &state.angles, constraint_set);
        let mut torques = chain.torques(legs, [R::zero(), R::splat(-GRAVITY)]);
        torques[0] += constraint_set.drive.hip_torque;
        (chain, give, torques)
    }

    /// Accelerations without any force but its own.
    #[inline(always)]
    pub(crate) fn accelerations(&self) -> Accelerations<R, N> {
        let trunk = self
            .base
            .as_ref()
            .map_or([<R::Sum as Real>::zero(); 6], |base| {
                base.schur.solve(base.schur.force)
            });
        self.with_trunk(trunk, &self.torques)
    }

    /// Accelerations of the links under these torques, on a trunk of this acceleration.
    #[inline(always)]
    pub(crate) fn with_trunk(
        &self,
        trunk: Spatial<R::Sum>,
        torques: &[R; N],
    ) -> Accelerations<R, N> {
        let mut torques = *torques;
        if let Some(base) = &self.base {
            for (torque, column) in torques.iter_mut().zip(&base.carried.columns) {
                for (c, &row) in column.iter().zip(&COUPLED) {
                    *torque -= *c * R::broadcast(trunk[row]);
                }
            }
        }
        Accelerations {
            trunk,
            links: self.give.accelerations(&torques),
            torques,
        }
    }

    /// What a unit force along a row does.
    pub(crate) fn response(&self, row: &Row<R::Sum, N>) -> Response<R::Sum, N> {
        let zero = <R::Sum as Real>::zero();
        let mut links = [zero; N];
        for i in 0..N {
            for j in 0..N {
                links[i] += self.give.mobility[i][j].lane(row.leg) * row.links[j];
            }
        }
        let Some(base) = &self.base else {
            return Response {
                links,
                pull: [zero; 6],
                trunk: [zero; 6],
            };
        };
        let mut pull = row.trunk;
        for (link, column) in links.iter().zip(&base.carried.columns) {
            for (c, &row_of_trunk) in column.iter().zip(&COUPLED) {
                pull[row_of_trunk] -= c.lane(row.leg) * *link;
            }
        }
        Response {
            links,
            pull,
            trunk: base.schur.solve(pull),
        }
    }

    /// Kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(
        &self,
        model: &Model<N>,
        legs: &Constants<R, N>,
        state: &State<R, N>,
    ) -> [R::Sum; 3] {
        let base = self.base.as_ref();
        let base = base.map(|base| (&base.carried, &base.trunk, &base.rotation));
        stored(model, legs, state, &self.chain, base)
    }
}

/// What a trunk that moves has to do with energy.
type Base<'a, R, const N: usize> = (
    &'a Carried<R, N>,
    &'a Trunk<<R as Real>::Sum>,
    &'a Rotation<<R as Real>::Sum>,
);

/// Kinetic, spring and gravity energy \[J\] of legs in a state, and of a trunk that moves.
pub(crate) fn stored<R: Real, const N: usize>(
    model: &Model<N>,
    legs: &Constants<R, N>,
    state: &State<R, N>,
    chain: &Chain<R, N>,
    base: Option<Base<'_, R, N>>,
) -> [R::Sum; 3] {
    let half = <R::Sum as Real>::splat(0.5);
    let gravity = <R::Sum as Real>::splat(GRAVITY);
    let mut kinetic = chain.kinetic_energy();
    if let Some(drives) = &model.drives {
        let [at_hip, at_pulley] = drives.inertias();
        let [hip, pulley] = [state.rates[0], state.pulley_rate];
        kinetic += R::splat(0.5 * at_hip) * hip * hip + R::splat(0.5 * at_pulley) * pulley * pulley;
    }
    let springs = chain.spring_energy(legs, &state.angles).sum();
    let Some((carried, trunk, rotation)) = base else {
        let mut height = R::zero();
        for i in 0..N {
            height -= legs.moments[i] * chain.cosines[i];
        }
        return [kinetic.sum(), springs, gravity * height.sum()];
    };
    let mut momentum = [R::zero(); 5];
    for (column, rate) in carried.columns.iter().zip(&state.rates) {
        for (sum, c) in momentum.iter_mut().zip(column) {
            *sum += *c * *rate;
        }
    }
    let mass = <R::Sum as Real>::splat(model.trunk.mass);
    let [v, w] = [state.velocity, state.turning];
    let twist = [v[0], v[1], v[2], w[0], w[1], w[2]];
    let mut total = kinetic.sum();
    for (sum, &row) in momentum.iter().zip(&COUPLED) {
        total += sum.sum() * twist[row];
    }
    let turned = cross(w, trunk.moment);
    for i in 0..3 {
        let mut spin = <R::Sum as Real>::zero();
        for j in 0..3 {
            spin += trunk.inertia[i][j] * w[j];
        }
        total += half * (mass * v[i] * v[i] + w[i] * spin) + v[i] * turned[i];
    }
    let height = mass * state.position[2] + into_world(rotation, trunk.moment)[2];
    [total, springs, gravity * height]
}

/// The same, from the state alone.
pub(crate) fn stored_in<R: Real, const N: usize>(
    model: &Model<N>,
    legs: &Constants<R, N>,
    state: &State<R, N>,
) -> [R::Sum; 3] {
    let chain = Chain::new(legs, &state.angles, &state.rates);
    if !model.is_free() {
        return stored(model, legs, state, &chain, None);
    }
    let still = [<R::Sum as Real>::zero(); 3];
    let carrier = Carrier {
        turning: still.map(R::broadcast),
        field: still.map(R::broadcast),
    };
    let carried = Carried::new(legs, &chain, &carrier);
    let trunk = Trunk::new(&model.trunk, &summed(&carried.burden), still, still);
    let upright = rotation(state.attitude);
    stored(
        model,
        legs,
        state,
        &chain,
        Some((&carried, &trunk, &upright)),
    )
}
