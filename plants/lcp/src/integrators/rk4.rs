//! Step of the classical Runge–Kutta method of fourth order.

use super::error_norm::error_norm;
use super::impulse_sums::ImpulseSums;
use super::right_hand_side::RightHandSide;
use super::run_state::RunState;
use super::substep::{Substep, TrialStep};
use crate::model::Model;
use crate::model::real::Lanes;
use crate::model::state::{Slope, normalised};

/// Computes one step.
///
/// The error is that of the third-order method with the slope at the end of the step in place of
/// the last stage. Errors of velocities are included: friction and motors do work by velocities,
/// which under strong friction may be inaccurate while positions are accurate. They are excluded
/// while a foot slides, as friction has no derivative where the foot comes to rest.
#[inline(never)]
pub(crate) fn rk4_step<const N: usize>(
    rhs: &mut RightHandSide<N>,
    model: &Model<N>,
    run: &mut RunState<N>,
    substep: &Substep<'_, N>,
    trial: &mut TrialStep<N>,
) {
    let Substep {
        start: state,
        motion: start,
        h,
        elapsed,
        recovery,
    } = *substep;
    let free = model.is_free();
    let half = h * Lanes::splat(0.5);
    let mut impulses = ImpulseSums::new();
    let mut mean = Slope::zero();
    mean.add(1.0 / 6.0, &start.slope, free);
    run.set_load_at(model, elapsed + half);
    let second = state.along(half, &start.slope, free);
    let second = rhs.stage(model, run, &second, recovery, None);
    mean.add(1.0 / 3.0, &second, free);
    let middle = state.along(half, &second, free);
    let third = Some((h * Lanes::splat(2.0 / 3.0), &mut impulses));
    let third = rhs.stage(model, run, &middle, recovery, third);
    mean.add(1.0 / 3.0, &third, free);
    run.set_load_at(model, elapsed + h);
    let fourth = state.along(h, &third, free);
    let fourth = rhs.stage(model, run, &fourth, recovery, None);
    mean.add(1.0 / 6.0, &fourth, free);
    trial.end = normalised(&state.along(h, &mean, free), free);
    rhs.motion_into(model, run, &trial.end, recovery, &mut trial.motion);
    let third_of_step = h * Lanes::splat(1.0 / 3.0);
    rhs.add_impulses(
        model,
        run,
        &trial.end,
        &trial.motion,
        third_of_step,
        &mut impulses,
    );
    let mut off = Slope::zero();
    off.add(1.0 / 6.0, &fourth, free);
    off.add(-1.0 / 6.0, &trial.motion.slope, free);
    let slides = run.mode.contacts.iter().any(|foot| foot.slides.is_some());
    trial.error = error_norm(model, &off, !slides) * h;
    (trial.dissipated, trial.actuator) = (h * mean.dissipated, h * mean.actuator);
    trial.external = h * mean.external;
    trial.impulses = impulses;
}
