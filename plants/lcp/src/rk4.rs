//! A step of the classical Runge–Kutta method of fourth order.

use crate::flow::{Flow, Tally};
use crate::march::Leap;
use crate::motion::Motion;
use crate::real::{Lanes, Real};
use crate::state::{Slope, State, normalised};

impl<const N: usize> Flow<N> {
    /// One step, of its own length in each lane where the trunk is held. `start` is the motion at `state`.
    ///
    /// The error is that of the method of third order which has the slope at the step's end in place of the last stage's.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn rk4_step(
        &mut self,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        h: Lanes,
        recovery: f64,
    ) -> Leap<N> {
        let free = self.model.is_free();
        let half = h * Lanes::splat(0.5);
        let mut felt = Tally::new();
        let mut mean = Slope::zero();
        mean.add(1.0 / 6.0, &start.slope, free);
        let second = self.motion(&state.along(half, &start.slope, free), recovery);
        mean.add(1.0 / 3.0, &second.slope, free);
        let middle = state.along(half, &second.slope, free);
        let third = self.motion(&middle, recovery);
        self.feel(&middle, &third, h * Lanes::splat(2.0 / 3.0), &mut felt);
        mean.add(1.0 / 3.0, &third.slope, free);
        let fourth = self.motion(&state.along(h, &third.slope, free), recovery);
        mean.add(1.0 / 6.0, &fourth.slope, free);
        let end = normalised(&state.along(h, &mean, free), free);
        let motion = self.motion(&end, recovery);
        self.feel(&end, &motion, h * Lanes::splat(1.0 / 3.0), &mut felt);
        let mut off = Slope::zero();
        off.add(1.0 / 6.0, &fourth.slope, free);
        off.add(-1.0 / 6.0, &motion.slope, free);
        let error = self.displacement(&off) * h;
        Leap {
            end,
            motion,
            dissipated: h * mean.dissipated,
            actuator: h * mean.actuator,
            felt,
            error,
        }
    }
}
