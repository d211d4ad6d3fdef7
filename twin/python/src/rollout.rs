//! Many runs of a rig from saved states, under commands given in advance.

use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Change, interrupt};

use crate::channels::{Channels, LaneFailure, Names, Results, Steps};
use crate::lanes::detached;
use crate::rig::{PyRig, refused, time};
use crate::rig_state::RigState;
use crate::samples::seconds;
use crate::workers::PyWorkers;

/// Run of one lane.
struct LaneRun<'a> {
    index: usize,
    /// State to begin with; none: that of a new rig.
    state: Option<&'a PyBackedBytes>,
    /// Values of process variables.
    variables: Vec<(&'a str, f64)>,
    steps: Steps<'a>,
    /// State at the end, or the failure.
    end: Result<Vec<u8>, LaneFailure>,
}

/// Rigs of the lanes.
struct Rigs<'a> {
    /// Rigs of the scenario without settings of lanes, each used by one thread at a time.
    pool: Mutex<Vec<Py<PyRig>>>,
    /// Whether the lanes use them; otherwise each builds its own.
    is_shared: bool,
    /// Function that builds the rig of a lane.
    build: &'a Py<PyAny>,
    names: &'a Names,
    step: SimDuration,
}

impl Rigs<'_> {
    /// Runs a lane, and keeps its rig for others.
    fn run(&self, lane: &mut LaneRun<'_>) {
        let rig = self.rig(lane.index);
        lane.end = rig.map_err(at_start).and_then(|rig| {
            let end = self.run_in(rig.get(), lane);
            if self.is_shared {
                lock(&self.pool).push(rig);
            } else {
                rig.get().close().map_err(at_start)?;
            }
            end
        });
    }

    /// Returns a rig that no other lane uses.
    fn rig(&self, lane: usize) -> PyResult<Py<PyRig>> {
        let pop = || self.is_shared.then(|| lock(&self.pool).pop()).flatten();
        while let Some(rig) = pop() {
            // After a panic, a rig is not used again.
            if rig.get().lock()?.state().is_ok() {
                return Ok(rig);
            }
        }
        Python::attach(|py| {
            let built = self.build.bind(py).call1((lane,))?;
            Ok(built.cast_into::<PyRig>()?.unbind())
        })
    }

    fn run_in(&self, rig: &PyRig, lane: &mut LaneRun<'_>) -> Result<Vec<u8>, LaneFailure> {
        let mut locked = rig.lock().map_err(at_start)?;
        let state = locked.state().map_err(at_start)?;
        let channels = self.begin(rig, state, lane).map_err(at_start)?;
        lane.steps.run(rig, state, &channels, self.step)?;
        let saved = state.save(&rig.scenario);
        saved.map_err(|error| (lane.steps.count(), seconds(state.reached), error))
    }

    /// Brings a rig to the begin of a lane.
    fn begin(&self, rig: &PyRig, state: &mut RigState, lane: &LaneRun<'_>) -> PyResult<Channels> {
        if let Some(saved) = lane.state {
            state.restore(saved, &rig.scenario)?;
        }
        let channels = Channels::new(state, self.names)?;
        if !lane.steps.fits(&channels) {
            return Err(PyValueError::new_err(
                "the signals or commands have another size with the settings of this lane",
            ));
        }
        let now = state.reached;
        for &(name, value) in &lane.variables {
            let set = state.rig.schedule(now, name, Change::To(value));
            set.map_err(refused)?;
        }
        Ok(channels)
    }
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic of a part does not reach the lock.
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Failure of a lane before its first step.
fn at_start(error: PyErr) -> LaneFailure {
    (0, f64::NAN, error)
}

/// Results of several lanes: values row by row, times \[s\] and falls, each lane after lane; final
/// state and failure of each lane; rigs for the next call.
type LaneResults<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Vec<Option<Bound<'py, PyBytes>>>,
    Vec<Option<LaneFailure>>,
    Vec<Py<PyRig>>,
);

/// Runs a lane from each of `states`, with steps of `step` \[s\], on the threads of `workers`.
///
/// If the lanes share a configuration, they use `rigs`, and `build` builds further ones where a
/// thread has none; otherwise `build` builds the rig of each lane. `shape` is the number of steps
/// and that of the values of each.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "arguments of Python are extracted into values"
)]
#[expect(clippy::too_many_arguments, reason = "as of the function of Python")]
pub(crate) fn rollout<'py>(
    py: Python<'py>,
    rigs: Vec<Py<PyRig>>,
    is_shared: bool,
    build: Py<PyAny>,
    names: Names,
    states: Vec<Option<PyBackedBytes>>,
    variables: Vec<(String, Vec<f64>)>,
    commands: PyReadonlyArray1<'py, f64>,
    shape: (usize, usize),
    step: f64,
    workers: &PyWorkers,
) -> PyResult<LaneResults<'py>> {
    let (step, (steps, read)) = (time(step)? - SimTime::ZERO, shape);
    if let Some(rig) = rigs.first() {
        // Unknown names are the error of the call, not that of each lane.
        Channels::new(rig.get().lock()?.state()?, &names)?;
    }
    let mut results = Results::new(states.len(), steps, read)?;
    let lanes = results.lanes(commands.as_slice()?, states.len());
    let lanes = lanes.into_iter().zip(&states).enumerate();
    let mut lanes: Vec<LaneRun<'_>> = lanes
        .map(|(index, (steps, state))| LaneRun {
            index,
            state: state.as_ref(),
            variables: variables
                .iter()
                .filter_map(|(name, values)| Some((name.as_str(), *values.get(index)?)))
                .collect(),
            steps,
            end: Ok(Vec::new()),
        })
        .collect();
    let rigs = Rigs {
        pool: Mutex::new(rigs),
        is_shared,
        build: &build,
        names: &names,
        step,
    };
    let simulated = step.checked_mul(steps as u64);
    detached(
        py,
        simulated.unwrap_or(SimDuration::from_nanos(u64::MAX)),
        || {
            workers.each(&mut lanes, |lane| {
                // After a request to end, the other lanes do not begin.
                if !interrupt::is_requested() {
                    rigs.run(lane);
                }
            });
        },
    )?;
    let ends: Vec<_> = lanes.into_iter().map(|lane| lane.end).collect();
    let state = |end: &Result<Vec<u8>, _>| end.as_ref().ok().map(|state| PyBytes::new(py, state));
    Ok((
        results.values.into_pyarray(py),
        results.times.into_pyarray(py),
        results.has_fallen.into_pyarray(py),
        ends.iter().map(state).collect(),
        ends.into_iter().map(Result::err).collect(),
        std::mem::take(&mut lock(&rigs.pool)),
    ))
}
