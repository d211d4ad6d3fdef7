//! Evaluation of the right-hand side in one state.

use twinrig_compliant::lanes::Simd;
use twinrig_compliant::{Commands, Limited};
use twinrig_legged::StepLoad;

use super::model::{CompliantModel, Legs};
use super::state::State;

/// Right-hand side in a state, to be called from several places.
pub(crate) struct Evaluation<
    'a,
    S: Simd,
    const N: usize,
    const P: usize,
    const A: usize,
    const B: usize,
> {
    pub(crate) simd: S,
    pub(crate) model: &'a CompliantModel<N, A>,
    pub(crate) legs: &'a Legs<S::Lanes, N, A>,
    pub(crate) commands: &'a Commands<S::Lanes>,
    pub(crate) time: f64,
    /// Load of pushes, if any.
    pub(crate) load: Option<&'a StepLoad>,
    pub(crate) state: &'a State<S::Lanes, N, P, A, B>,
    /// Joints at the limit of their torque, once they are known.
    pub(crate) limits: Option<Limits<S::Lanes>>,
}

/// Joints at the limit of their torque.
#[derive(Clone, Copy)]
pub(crate) struct Limits<L> {
    pub(super) hip: Limited<L>,
    /// Joints of abduction, if there are any.
    pub(super) abduction: Option<Limited<L>>,
    /// Number of times that they may be determined again.
    pub(super) rounds: u8,
}
