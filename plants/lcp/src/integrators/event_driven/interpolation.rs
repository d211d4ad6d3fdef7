//! States within a step, and gaps that close and open within it.

use crate::constraints::guards::{Guards, STOPS, at_foot};
use crate::integrators::root::first_root_of_cubic;
use crate::integrators::substep::{Substep, TrialStep};
use crate::model::real::{Lanes, Real};
use crate::model::state::{Slope, State, normalised};

/// Returns whether a gap may have closed and opened again within a step.
pub(super) fn dips(before: &Guards, after: &Guards, h: Lanes) -> bool {
    let indices = (0..STOPS).chain([at_foot(3, 0), at_foot(4, 0)]);
    indices.into_iter().any(|index| {
        let [a, b] = [before, after].map(|g| g.values[index]);
        let [u, v] = [before, after].map(|g| g.rates[index]);
        let zero = Lanes::zero();
        if !(u.simd_lt(zero) & v.simd_gt(zero)).any() {
            return false;
        }
        let [a, b] = [a, b].map(Lanes::to_array);
        let [u, v] = [u, v].map(Lanes::to_array);
        (0..4).any(|leg| {
            let seconds = h.lane(leg);
            u[leg] < 0.0
                && v[leg] > 0.0
                && a[leg].min(b[leg]) < 0.25 * seconds * (v[leg] - u[leg])
                && first_root_of_cubic(a[leg], u[leg] * seconds, b[leg], v[leg] * seconds).is_some()
        })
    })
}

/// Returns the state in the middle of a step from values and slopes at both ends; third order.
pub(super) fn midpoint_state<const N: usize>(
    substep: &Substep<'_, N>,
    trial: &TrialStep<N>,
    free: bool,
) -> State<Lanes, N> {
    let Substep {
        start: state,
        motion: start,
        h,
        ..
    } = *substep;
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let mut middle = trial.end;
    for (m, a) in middle.angles.iter_mut().zip(&state.angles) {
        *m = Lanes::splat(0.5) * (*m + *a);
    }
    for (m, a) in middle.rates.iter_mut().zip(&state.rates) {
        *m = Lanes::splat(0.5) * (*m + *a);
    }
    middle.pulley = Lanes::splat(0.5) * (middle.pulley + state.pulley);
    middle.pulley_rate = Lanes::splat(0.5) * (middle.pulley_rate + state.pulley_rate);
    for i in 0..3 {
        middle.position[i] = half(middle.position[i], state.position[i]);
        middle.velocity[i] = half(middle.velocity[i], state.velocity[i]);
        middle.turning[i] = half(middle.turning[i], state.turning[i]);
    }
    for i in 0..4 {
        middle.attitude[i] = half(middle.attitude[i], state.attitude[i]);
    }
    let mut bend = Slope::zero();
    bend.add(0.125, &start.slope, free);
    bend.add(-0.125, &trial.motion.slope, free);
    normalised(&middle.along(h, &bend, free), free)
}

/// Advances by a time for which a second-order expansion is exact.
pub(super) fn taylor<const N: usize>(
    state: &State<Lanes, N>,
    slope: &Slope<Lanes, N>,
    seconds: Lanes,
    free: bool,
) -> State<Lanes, N> {
    let mut next = state.along(seconds, slope, free);
    let half = Lanes::splat(0.5) * seconds * seconds;
    for (angle, acceleration) in next.angles.iter_mut().zip(&slope.rates) {
        *angle += half * *acceleration;
    }
    next.pulley += half * slope.pulley_rate;
    normalised(&next, free)
}
