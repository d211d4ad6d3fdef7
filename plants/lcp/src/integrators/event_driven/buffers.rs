//! Buffers of the event-driven integrator, and the key of the motion that they keep between steps.

use crate::constraints::guards::Guards;
use crate::constraints::motion::Motion;
use crate::integrators::run_state::RunState;
use crate::integrators::substep::TrialStep;
use crate::model::drives::Commands;
use crate::model::leg_constraints::ActiveConstraints;
use crate::model::real::Lanes;
use crate::model::state::State;

/// Buffers of the event-driven integrator: large values that are moved instead of copied.
#[derive(Debug, Clone)]
pub(super) struct Buffers<const N: usize> {
    pub(super) start: Box<Motion<Lanes, N>>,
    /// Guards at the start and at the end of a substep.
    pub(super) guards: Guards,
    pub(super) after: Guards,
    pub(super) trial: TrialStep<N>,
    /// Arguments for which `start` is valid.
    pub(super) key: Option<MotionKey<N>>,
}

/// Arguments of a motion without contacts, as a cache key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionKey<const N: usize> {
    state: State<Lanes, N>,
    active: ActiveConstraints<Lanes>,
    commands: Commands<Lanes>,
    pub(super) recovery: f64,
}

impl<const N: usize> Buffers<N> {
    /// Storage for steps from this state.
    pub(super) fn blank(state: State<Lanes, N>) -> Self {
        Self {
            start: Box::new(Motion::blank()),
            guards: Guards::inactive(),
            after: Guards::inactive(),
            trial: TrialStep::blank(state),
            key: None,
        }
    }
}

/// Returns the cache key of the present motion; none with contacts, where caching is not
/// worthwhile, and under a push, which may be discontinuous between steps.
pub(super) fn motion_key<const N: usize>(run: &RunState<N>, recovery: f64) -> Option<MotionKey<N>> {
    let is_cached = run.mode.contacts.is_empty() && run.mode.load.is_none();
    is_cached.then_some(MotionKey {
        state: run.state,
        active: run.mode.active,
        commands: run.mode.commands,
        recovery,
    })
}
