//! Rigs that advance side by side, a step of each in one call.
#![expect(
    clippy::needless_pass_by_value,
    reason = "arguments of Python are extracted into values"
)]

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use twinrig::kernel::{SimDuration, SimTime};

use crate::channels::{Channels, LaneFailure, Names, Results, Steps};
use crate::errors::Failure;
use crate::rig::{Locked, PyRig, time};
use crate::rig_state::{RigState, SLICE};
use crate::supervised::supervised;
use crate::workers::PyWorkers;

/// A rig with the commands that it is given and the signals that are read of it.
#[pyclass(name = "Lane", module = "twinrig._native", frozen)]
pub(crate) struct PyLane {
    rig: Py<PyRig>,
    channels: Channels,
}

#[pymethods]
impl PyLane {
    #[new]
    fn new(rig: Py<PyRig>, names: Names) -> PyResult<Self> {
        let channels = Channels::new(rig.get().lock()?.state()?, &names)?;
        Ok(Self { rig, channels })
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.rig)
    }
}

/// Step of one lane among several.
struct LaneStep<'a> {
    lane: &'a PyLane,
    state: &'a mut RigState,
    steps: Steps<'a>,
    error: Option<LaneFailure>,
}

/// Results of several lanes: values row by row, times \[s\] and falls, each lane after lane, and
/// the failure of each lane.
type LaneResults<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Vec<Option<LaneFailure>>,
);

/// Advances the rig of every lane by `step` \[s\] under its row of `commands`, or to the end of its
/// scenario, on the threads of `workers`.
#[pyfunction]
pub(crate) fn step_lanes<'py>(
    py: Python<'py>,
    lanes: Vec<Py<PyLane>>,
    commands: PyReadonlyArray1<'py, f64>,
    step: f64,
    workers: &PyWorkers,
) -> PyResult<LaneResults<'py>> {
    let step = time(step)? - SimTime::ZERO;
    let commands = commands.as_slice()?;
    let lanes: Vec<&PyLane> = lanes.iter().map(Py::get).collect();
    let widths = |lane: &PyLane| (lane.channels.commanded, lane.channels.read);
    let (commanded, read) = lanes.first().map_or((0, 0), |lane| widths(lane));
    if lanes.iter().any(|lane| widths(lane) != (commanded, read))
        || commands.len() != lanes.len() * commanded
    {
        return Err(PyValueError::new_err(
            "lanes with other commands or signals",
        ));
    }
    let locks = lanes.iter().map(|lane| lane.rig.get().lock());
    let mut locks = locks.collect::<PyResult<Vec<_>>>()?;
    let states = locks.iter_mut().map(Locked::state);
    let states = states.collect::<PyResult<Vec<_>>>()?;
    let mut results = Results::new(lanes.len(), 1, read)?;
    let steps = results.lanes(commands, lanes.len());
    let items = lanes.iter().zip(states).zip(steps);
    let mut items: Vec<_> = items
        .map(|((lane, state), steps)| LaneStep {
            lane,
            state,
            steps,
            error: None,
        })
        .collect();
    detached(py, step, || {
        workers.each(&mut items, |item| {
            let PyLane { rig, channels } = item.lane;
            item.error = item.steps.run(rig.get(), item.state, channels, step).err();
        });
    })?;
    let errors = items.into_iter().map(|item| item.error).collect();
    Ok((
        results.values.into_pyarray(py),
        results.times.into_pyarray(py),
        results.has_fallen.into_pyarray(py),
        errors,
    ))
}

/// Does `work`, which simulates `duration`, with the interpreter released. Long work ends where a
/// handler of Python's signals raises; short work leaves the signals to the interpreter.
pub(crate) fn detached<R: Send>(
    py: Python<'_>,
    duration: SimDuration,
    work: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    if duration <= SLICE {
        return Ok(py.detach(work));
    }
    let done = supervised(py, work)?;
    match (done.interrupt, done.result) {
        (Some(raised), _) => Err(raised),
        (None, Ok(result)) => Ok(result),
        (None, Err(panic)) => Err(Failure::from(panic).raised(py)),
    }
}
