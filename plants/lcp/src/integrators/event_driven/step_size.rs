//! Step-size control.

use super::{EventDriven, TrialStep};
use crate::model::Model;
use crate::model::real::{Lanes, Real};

impl<const N: usize> EventDriven<N> {
    /// Shortens the steps of islands whose error exceeds the tolerance; returns whether there were
    /// any.
    pub(super) fn shorten(&self, model: &Model<N>, trial: &TrialStep<N>, h: &mut Lanes) -> bool {
        let zero = Lanes::zero();
        if (trial.error.simd_le(Lanes::splat(self.tolerance)) | h.simd_eq(zero)).all() {
            return false;
        }
        let mut shorter = false;
        for island in model.islands() {
            let leg = island.start;
            let (error, length) = (trial.error.lane(leg), h.lane(leg));
            if length == 0.0 || error <= self.tolerance {
                continue;
            }
            shorter = true;
            let factor = if error.is_finite() {
                (0.9 * fourth_root(self.tolerance / error)).max(0.1)
            } else {
                0.1
            };
            for leg in model.lanes_of(island) {
                *h = h.with_lane(leg, length * factor);
            }
        }
        shorter
    }

    /// Sets the proposed next step size of each island.
    pub(super) fn propose_step_size(
        &mut self,
        model: &Model<N>,
        trial: &TrialStep<N>,
        h: Lanes,
        remaining: &Lanes,
    ) {
        // The usual case: all islands reach the end of the step far below the tolerance, and none
        // is limited.
        let easy = trial.error.simd_lt(Lanes::splat(0.6 * self.tolerance))
            & h.simd_ge(*remaining)
            & h.simd_gt(Lanes::zero());
        let lanes = model.leg_times(1.0).simd_gt(Lanes::zero());
        if easy.to_bitmask() == lanes.to_bitmask() {
            self.step_size = Lanes::splat(f64::INFINITY);
            return;
        }
        for island in model.islands() {
            let leg = island.start;
            let (error, length) = (trial.error.lane(leg), h.lane(leg));
            if length == 0.0 {
                continue;
            }
            let factor = (0.9 * fourth_root(self.tolerance / error)).clamp(0.2, 4.0);
            // A step limited by the end of its time does not limit the next one.
            let to_end = length >= remaining.lane(leg);
            let next = length * factor;
            let next = if to_end {
                next.max(self.step_size.lane(leg))
            } else {
                next
            };
            let next = if to_end && factor >= 1.0 {
                f64::INFINITY
            } else {
                next
            };
            for leg in model.lanes_of(island) {
                self.step_size = self.step_size.with_lane(leg, next);
            }
        }
    }
}

pub(super) fn fourth_root(x: f64) -> f64 {
    libm::sqrt(libm::sqrt(x))
}
