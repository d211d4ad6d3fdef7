//! Steps of several rigs at once.

use pyo3::prelude::*;
use twinrig::kernel::{SimDuration, SimTime};

use crate::poll::Poll;
use crate::rig::{Locked, PyRig, time};
use crate::rig_state::{RigState, RunOutcome, SLICE};
use crate::workers::PyWorkers;

/// Step of a rig among several.
struct RigStep<'a> {
    state: &'a mut RigState,
    /// End of the present slice, and of the step.
    next: SimTime,
    to: SimTime,
    outcome: Option<RunOutcome>,
    error: Option<PyErr>,
}

impl<'a> RigStep<'a> {
    fn new(rig: &PyRig, state: &'a mut RigState, duration: SimDuration) -> PyResult<Self> {
        let now = state.reached;
        let to = rig.after(now, duration)?;
        Ok(Self {
            state,
            next: now,
            to,
            outcome: None,
            error: None,
        })
    }

    /// Runs the next slice without the interpreter, unless an earlier one has failed.
    fn run_slice(&mut self) {
        if self.error.is_none() {
            let next = self.next.checked_add(SLICE);
            self.next = next.map_or(self.to, |next| next.min(self.to));
            self.outcome = Some(self.state.run_until(self.next));
        }
    }

    fn finish_slice(&mut self) {
        if let Some(outcome) = self.outcome.take() {
            self.error = self.state.finish(self.next, outcome).err();
        }
    }

    fn has_ended(&self) -> bool {
        self.error.is_some() || self.next == self.to
    }
}

/// Advances every rig by `duration` \[s\] or to the end of its scenario, on the threads of
/// `workers`, and returns the exception of each, or None. Python's signals are polled in a long
/// step; an exception of a handler leaves all rigs at the end of the same slice.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "arguments of Python are extracted into values"
)]
pub(crate) fn step_all(
    py: Python<'_>,
    rigs: Vec<PyRef<'_, PyRig>>,
    duration: f64,
    workers: &PyWorkers,
) -> PyResult<Vec<Option<PyErr>>> {
    let duration = time(duration)? - SimTime::ZERO;
    let mut locks: Vec<Locked<'_>> = rigs.iter().map(|rig| rig.lock()).collect::<PyResult<_>>()?;
    let states = locks.iter_mut().map(Locked::state);
    let steps = rigs.iter().zip(states);
    let steps = steps.map(|(rig, state)| RigStep::new(rig, state?, duration));
    let mut steps: Vec<RigStep<'_>> = steps.collect::<PyResult<_>>()?;
    // A short step leaves the signals to the interpreter, and reads no clock.
    let mut poll = (duration > SLICE).then(Poll::new);
    loop {
        py.detach(|| workers.each(&mut steps, RigStep::run_slice));
        for step in &mut steps {
            step.finish_slice();
        }
        if steps.iter().all(RigStep::has_ended) {
            return Ok(steps.into_iter().map(|step| step.error).collect());
        }
        if let Some(poll) = &mut poll {
            poll.signals(py)?;
        }
    }
}
