//! Solution of a step.

use crate::model::real::Lanes;
use crate::model::state::State;

/// Solution of a step.
pub(super) struct SolvedStep<const N: usize> {
    pub(super) after: State<Lanes, N>,
    /// Means of the rates before and after the impulses.
    pub(super) mean: [Lanes; N],
    /// Work of pushes \[J\].
    pub(super) external: f64,
    /// Tension of the cables and torques of the motors, mean over the step, and work of the hip
    /// motors \[J\].
    pub(super) tension: Lanes,
    pub(super) torques: [Lanes; 2],
    pub(super) hip_work: Lanes,
}
