//! Substep of an event-driven step: its start, and its trial end.

use super::impulse_sums::ImpulseSums;
use crate::constraints::motion::Motion;
use crate::model::real::{Lanes, Real};
use crate::model::state::State;

/// Start and length of a substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Substep<'a, const N: usize> {
    pub(crate) start: &'a State<Lanes, N>,
    /// The motion at `start`.
    pub(crate) motion: &'a Motion<Lanes, N>,
    /// Length \[s\]; on a fixed trunk it may differ from lane to lane.
    pub(crate) h: Lanes,
    /// Time from the begin of the step to that of the substep \[s\].
    pub(crate) elapsed: Lanes,
    /// Decay rate of constraint errors \[1/s\].
    pub(crate) recovery: f64,
}

/// Result of a trial step.
#[derive(Debug, Clone)]
pub(crate) struct TrialStep<const N: usize> {
    pub(crate) end: State<Lanes, N>,
    /// The motion at `end`, in the same mode.
    pub(crate) motion: Box<Motion<Lanes, N>>,
    /// Work dissipated by friction, work of the motors and of pushes, by leg \[J\].
    pub(crate) dissipated: Lanes,
    pub(crate) actuator: Lanes,
    pub(crate) external: Lanes,
    /// Impulses of drives and ground during the step.
    pub(crate) impulses: ImpulseSums,
    /// Error estimate of the foot position \[m\].
    pub(crate) error: Lanes,
}

impl<const N: usize> TrialStep<N> {
    /// Storage for a step from this state.
    pub(crate) fn blank(state: State<Lanes, N>) -> Self {
        let zero = Lanes::zero();
        Self {
            end: state,
            motion: Box::new(Motion::blank()),
            dissipated: zero,
            actuator: zero,
            external: zero,
            impulses: ImpulseSums::new(),
            error: zero,
        }
    }
}
