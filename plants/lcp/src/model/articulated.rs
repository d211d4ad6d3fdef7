//! Trunk and legs in one state: inertia, accelerations and responses to forces.

use twinrig_robot::GRAVITY;

use crate::model::Model;
use crate::model::chain::Chain;
use crate::model::constants::Constants;
use crate::model::coupling::{COUPLED, LegCoupling, TrunkMotion};
use crate::model::elimination::{ConstraintSet, LegMobility};
use crate::model::load::Load;
use crate::model::real::Real;
use crate::model::rotation::{Rotation, identity, into_trunk, rotation};
use crate::model::state::State;
use crate::model::trunk::{Schur, Spatial, Trunk, cross, summed};

/// Trunk and legs in one state, with the active constraints inside the legs eliminated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Articulated<R: Real, const N: usize> {
    pub(crate) chain: Chain<R, N>,
    pub(crate) mobility: LegMobility<R, N>,
    /// Torques on the links: springs, friction, gravity, velocity terms, saturated motors.
    pub(crate) torques: [R; N],
    /// Terms of a moving trunk; none where the trunk is fixed.
    pub(crate) base: Option<Floating<R, N>>,
}

/// Terms of a moving trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Floating<R: Real, const N: usize> {
    pub(crate) coupling: LegCoupling<R, N>,
    pub(crate) trunk: Trunk<R::Sum>,
    pub(crate) schur: Schur<R::Sum>,
    pub(crate) rotation: Rotation<R::Sum>,
}

/// Accelerations of trunk and links.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Accelerations<R: Real, const N: usize> {
    pub(crate) trunk: Spatial<R::Sum>,
    pub(crate) links: [R; N],
    /// Torques in the equations of the legs: all except the constraint forces inside the legs.
    pub(crate) torques: [R; N],
}

/// Row of a constraint Jacobian: gradient of a gap with respect to the velocities of the trunk and
/// of one leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<T, const N: usize> {
    pub(crate) leg: usize,
    pub(crate) trunk: Spatial<T>,
    pub(crate) links: [T; N],
}

/// Response of trunk and links to a unit force along a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Response<T, const N: usize> {
    /// Φ Jᵀ: accelerations of the links with the trunk fixed.
    pub(crate) links: [T; N],
    /// Force on the trunk, w = Jₜ − C Φ Jᵀ, and its acceleration, S⁻¹ w.
    pub(crate) pull: Spatial<T>,
    pub(crate) trunk: Spatial<T>,
}

fn add<T: Real, const M: usize>(sums: &mut [T; M], values: &[T; M]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += *value;
    }
}

/// Returns the acceleration along `row` per unit force along `other`: `pull` is the force on the
/// trunk by a unit force along `row`, `response` the response to a unit force along `other`.
#[inline(always)]
pub(crate) fn cross_mobility<T: Real, const N: usize>(
    row: &Row<T, N>,
    pull: &Spatial<T>,
    other: &Row<T, N>,
    response: &Response<T, N>,
) -> T {
    let mut sum = T::zero();
    for i in 0..6 {
        sum += pull[i] * response.trunk[i];
    }
    cross_mobility_links(sum, row, other, response)
}

/// Adds the links' part to `sum`, the trunk's part of the mobility.
#[inline(always)]
pub(crate) fn cross_mobility_links<T: Real, const N: usize>(
    mut sum: T,
    row: &Row<T, N>,
    other: &Row<T, N>,
    response: &Response<T, N>,
) -> T {
    if row.leg == other.leg {
        for i in 0..N {
            sum += row.links[i] * response.links[i];
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
        (chain, mobility): (&Chain<R, N>, &LegMobility<R, N>),
        load: Option<&Load<R>>,
    ) -> Self {
        let none = <R::Sum as Real>::zero();
        let rotation = rotation(state.attitude);
        let weight = into_trunk(&rotation, [none, none, <R::Sum as Real>::splat(-GRAVITY)]);
        let turned = cross(state.turning, state.velocity);
        let field = std::array::from_fn(|i| weight[i] - turned[i]);
        let carrier = TrunkMotion {
            turning: state.turning.map(R::broadcast),
            field: field.map(R::broadcast),
        };
        let mut coupling = LegCoupling::new(legs, chain, &carrier);
        coupling.torques[0] += constraint_set.drive.hip_torque;
        let mut trunk = Trunk::new(
            &model.trunk,
            &summed(&coupling.contribution),
            state.turning,
            field,
        );
        if let Some(load) = load {
            let pushed = load.forces(legs, [&chain.sines, &chain.cosines], &rotation);
            add(&mut coupling.torques, &pushed.links);
            add(&mut trunk.force, &pushed.trunk);
        }
        let schur = Schur::new(&model.trunk, &trunk, &coupling, mobility);
        Self {
            coupling,
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
        load: Option<&Load<R>>,
    ) -> Self {
        let (chain, mobility, torques);
        let mut base = None;
        if model.is_free() {
            chain = Chain::new(legs, &state.angles, &state.rates);
            mobility = chain.mobility(legs, &state.angles, constraint_set);
            let leg = (&chain, &mobility);
            let floating = Floating::new(model, legs, state, constraint_set, leg, load);
            torques = floating.coupling.torques;
            base = Some(floating);
        } else {
            (chain, mobility, torques) = Self::legs(legs, state, constraint_set, load);
        }
        Self {
            chain,
            mobility,
            torques,
            base,
        }
    }

    /// Storage for [`Articulated::update`].
    #[inline(always)]
    pub(crate) fn blank() -> Self {
        Self {
            chain: Chain::blank(),
            mobility: LegMobility::blank(),
            torques: [R::zero(); N],
            base: None,
        }
    }

    /// Computes another state in place, without moving the large struct.
    #[inline(always)]
    pub(crate) fn update(
        &mut self,
        model: &Model<N>,
        legs: &Constants<R, N>,
        state: &State<R, N>,
        constraint_set: &ConstraintSet<'_, R>,
        load: Option<&Load<R>>,
    ) {
        if !model.is_free() {
            (self.chain, self.mobility, self.torques) =
                Self::legs(legs, state, constraint_set, load);
            self.base = None;
            return;
        }
        self.chain = Chain::new(legs, &state.angles, &state.rates);
        self.mobility = self.chain.mobility(legs, &state.angles, constraint_set);
        let leg = (&self.chain, &self.mobility);
        let base = Floating::new(model, legs, state, constraint_set, leg, load);
        self.torques = base.coupling.torques;
        self.base = Some(base);
    }

    /// Computes the inertia of another state in place: no forces, trunk axes parallel to world
    /// axes.
    #[inline(always)]
    pub(crate) fn unload(
        &mut self,
        model: &Model<N>,
        legs: &Constants<R, N>,
        [angles, rates]: [&[R; N]; 2],
        constraint_set: &ConstraintSet<'_, R>,
    ) {
        self.chain = Chain::new(legs, angles, rates);
        self.mobility = self.chain.mobility(legs, angles, constraint_set);
        self.torques = [R::zero(); N];
        if !model.is_free() {
            self.base = None;
            return;
        }
        let coupling = LegCoupling::unloaded(legs, &self.chain);
        let trunk = Trunk::unloaded(&model.trunk, &summed(&coupling.contribution));
        let schur = Schur::with(&model.trunk, &trunk, &coupling, &self.mobility, trunk.force);
        self.base = Some(Floating {
            coupling,
            trunk,
            schur,
            rotation: identity(),
        });
    }

    /// Computes the legs on a fixed trunk and the torques on their links.
    #[inline(always)]
    pub(crate) fn legs(
        legs: &Constants<R, N>,
        state: &State<R, N>,
        constraint_set: &ConstraintSet<'_, R>,
        load: Option<&Load<R>>,
    ) -> (Chain<R, N>, LegMobility<R, N>, [R; N]) {
        let chain = Chain::new(legs, &state.angles, &state.rates);
        let mobility = chain.mobility(legs, &state.angles, constraint_set);
        let mut torques = chain.torques(legs, [R::zero(), R::splat(-GRAVITY)]);
        torques[0] += constraint_set.drive.hip_torque;
        if let Some(load) = load {
            let pushed = load.forces(legs, [&chain.sines, &chain.cosines], &identity());
            add(&mut torques, &pushed.links);
        }
        (chain, mobility, torques)
    }

    /// Returns the accelerations without contact forces.
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

    /// Returns the accelerations of the links under these torques, on a trunk with this
    /// acceleration.
    #[inline(always)]
    pub(crate) fn with_trunk(
        &self,
        trunk: Spatial<R::Sum>,
        torques: &[R; N],
    ) -> Accelerations<R, N> {
        let mut torques = *torques;
        if let Some(base) = &self.base {
            for (torque, column) in torques.iter_mut().zip(&base.coupling.columns) {
                for (c, &row) in column.iter().zip(&COUPLED) {
                    *torque -= *c * R::broadcast(trunk[row]);
                }
            }
        }
        Accelerations {
            trunk,
            links: self.mobility.accelerations(&torques),
            torques,
        }
    }

    /// Computes the response to a unit force along a row.
    pub(crate) fn response(&self, row: &Row<R::Sum, N>) -> Response<R::Sum, N> {
        let zero = <R::Sum as Real>::zero();
        let mut links = [zero; N];
        for i in 0..N {
            for j in 0..N {
                links[i] += self.mobility.matrix[i][j].lane(row.leg) * row.links[j];
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
        for (link, column) in links.iter().zip(&base.coupling.columns) {
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

    /// Returns the rotation from trunk to world; the identity for a fixed trunk.
    pub(crate) fn rotation(&self) -> Rotation<R::Sum> {
        self.base.as_ref().map_or(identity(), |base| base.rotation)
    }
}
