//! Kinetic, spring and gravity energy of trunk and legs.

use twinrig_robot::GRAVITY;

use super::Model;
use super::articulated::Articulated;
use super::chain::Chain;
use super::constants::Constants;
use super::coupling::{COUPLED, LegCoupling, TrunkMotion};
use super::real::Real;
use super::rotation::{Rotation, into_world, rotation};
use super::state::State;
use super::trunk::{Trunk, cross, summed};

impl<R: Real, const N: usize> Articulated<R, N> {
    /// Returns kinetic, spring and gravity energy \[J\].
    pub(crate) fn stored(
        &self,
        model: &Model<N>,
        legs: &Constants<R, N>,
        state: &State<R, N>,
    ) -> [R::Sum; 3] {
        let base = self.base.as_ref();
        let base = base.map(|base| (&base.coupling, &base.trunk, &base.rotation));
        stored(model, legs, state, &self.chain, base)
    }
}

/// Terms of a moving trunk in the energy.
type Base<'a, R, const N: usize> = (
    &'a LegCoupling<R, N>,
    &'a Trunk<<R as Real>::Sum>,
    &'a Rotation<<R as Real>::Sum>,
);

/// Returns kinetic, spring and gravity energy \[J\] of the legs in a state, and of a moving trunk.
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
    let Some((coupling, trunk, rotation)) = base else {
        let mut height = R::zero();
        for i in 0..N {
            height -= legs.moments[i] * chain.cosines[i];
        }
        return [kinetic.sum(), springs, gravity * height.sum()];
    };
    let mut momentum = [R::zero(); 5];
    for (column, rate) in coupling.columns.iter().zip(&state.rates) {
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

/// Returns the same from the state alone.
pub(crate) fn stored_in<R: Real, const N: usize>(
    model: &Model<N>,
    legs: &Constants<R, N>,
    state: &State<R, N>,
) -> [R::Sum; 3] {
    let chain = Chain::new(legs, &state.angles, &state.rates);
    if !model.is_free() {
        return stored(model, legs, state, &chain, None);
    }
    let zero = [<R::Sum as Real>::zero(); 3];
    let carrier = TrunkMotion {
        turning: zero.map(R::broadcast),
        field: zero.map(R::broadcast),
    };
    let coupling = LegCoupling::new(legs, &chain, &carrier);
    let trunk = Trunk::new(&model.trunk, &summed(&coupling.contribution), zero, zero);
    let upright = rotation(state.attitude);
    stored(
        model,
        legs,
        state,
        &chain,
        Some((&coupling, &trunk, &upright)),
    )
}
