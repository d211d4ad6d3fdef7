//! Step of the classical Runge–Kutta method of fourth order.

use crate::constraints::motion::Motion;
use crate::integrators::event_driven::TrialStep;
use crate::integrators::flow::Flow;
use crate::integrators::impulse_sums::ImpulseSums;
use crate::model::real::Lanes;
use crate::model::state::{Slope, State, normalised};

impl<const N: usize> Flow<N> {
    /// Computes one step; on a fixed trunk its length may differ from lane to lane. `start` is the
    /// motion at `state`.
    ///
    /// The error is that of the third-order method with the slope at the end of the step in place
    /// of the last stage. Errors of velocities are included: friction and motors do work by
    /// velocities, which under strong friction may be inaccurate while positions are accurate. They
    /// are excluded while a foot slides, as friction has no derivative where the foot comes to
    /// rest.
    #[inline(never)]
    pub(crate) fn rk4_step(
        &mut self,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        h: Lanes,
        recovery: f64,
        trial: &mut TrialStep<N>,
    ) {
        let free = self.model.is_free();
        let half = h * Lanes::splat(0.5);
        let mut impulses = ImpulseSums::new();
        let mut mean = Slope::zero();
        mean.add(1.0 / 6.0, &start.slope, free);
        let second = state.along(half, &start.slope, free);
        let second = self
            .rhs
            .stage(&self.model, &mut self.run, &second, recovery, None);
        mean.add(1.0 / 3.0, &second, free);
        let middle = state.along(half, &second, free);
        let third = Some((h * Lanes::splat(2.0 / 3.0), &mut impulses));
        let third = self
            .rhs
            .stage(&self.model, &mut self.run, &middle, recovery, third);
        mean.add(1.0 / 3.0, &third, free);
        let fourth = state.along(h, &third, free);
        let fourth = self
            .rhs
            .stage(&self.model, &mut self.run, &fourth, recovery, None);
        mean.add(1.0 / 6.0, &fourth, free);
        trial.end = normalised(&state.along(h, &mean, free), free);
        self.rhs.motion_into(
            &self.model,
            &mut self.run,
            &trial.end,
            recovery,
            &mut trial.motion,
        );
        self.rhs.add_impulses(
            &self.model,
            &self.run,
            &trial.end,
            &trial.motion,
            h * Lanes::splat(1.0 / 3.0),
            &mut impulses,
        );
        let mut off = Slope::zero();
        off.add(1.0 / 6.0, &fourth, free);
        off.add(-1.0 / 6.0, &trial.motion.slope, free);
        let slides = self
            .run
            .mode
            .contacts
            .iter()
            .any(|foot| foot.slides.is_some());
        trial.error = self.error_of(&off, !slides) * h;
        (trial.dissipated, trial.actuator) = (h * mean.dissipated, h * mean.actuator);
        trial.impulses = impulses;
    }
}
