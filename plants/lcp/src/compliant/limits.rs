//! Joints of abduction at the limit of their torque.

use twinrig_compliant::Limited;
use twinrig_compliant::lanes::{Lanes, Simd};

use super::evaluation::{Evaluation, Limits};
use super::solution::Solution;
use super::state::Slope;

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    Evaluation<'_, S, N, P, A, B>
{
    /// Returns the joints of abduction whose servos need a torque beyond its limit, if there are
    /// servos with a limit.
    #[inline(always)]
    pub(super) fn beyond(&self, solution: &Solution<L, N>) -> Option<Limited<L>> {
        let (joints, state) = (self.legs.joints.first()?, self.state.abduction.first()?);
        joints.beyond(solution.joint.as_ref()?, state)
    }

    /// Returns the joints of abduction at their limit in the next round, and whether they differ.
    #[inline(always)]
    pub(super) fn next_abduction(
        &self,
        limits: &Limits<L>,
        solution: &Solution<L, N>,
    ) -> Option<(Limited<L>, bool)> {
        let (joints, state) = (self.legs.joints.first()?, self.state.abduction.first()?);
        let command = self.commands.abduction_at(self.time);
        let limited = limits.abduction.as_ref()?;
        joints.next(limited, solution.joint.as_ref()?, &command, state)
    }

    /// Returns the slope with the joints of abduction at the limit of their torque, if they differ
    /// from those assumed, of legs whose hips have no such limit.
    #[inline(always)]
    pub(super) fn limit_abduction(
        &self,
        solution: &Solution<L, N>,
    ) -> Option<Slope<L, N, P, A, B>> {
        let limits = match self.limits {
            None => {
                let abduction = self.beyond(solution).filter(Limited::any)?;
                Limits {
                    hip: Limited::none(abduction.torque.zero()),
                    abduction: Some(abduction),
                    rounds: Limited::<L>::ROUNDS,
                }
            }
            Some(limits) => {
                let (abduction, differs) = self.next_abduction(&limits, solution)?;
                let rounds = limits.rounds.checked_sub(1).filter(|_| differs)?;
                Limits {
                    abduction: Some(abduction),
                    rounds,
                    ..limits
                }
            }
        };
        let limits = Some(limits);
        Some(self.simd.call(Self { limits, ..*self }))
    }
}
