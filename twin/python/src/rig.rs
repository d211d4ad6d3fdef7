//! The stepped interface: a rig that Python advances.
#![expect(
    clippy::needless_pass_by_value,
    reason = "arguments of Python are extracted into values"
)]

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyError, PyRuntimeError, PyValueError};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{Change, RigError, catch_panic};
use twinrig::{Assembly, TwinError};
use twinrig_record::Fingerprint;

use crate::errors::Failure;
use crate::fall::Fall;
use crate::fork::Generation;
use crate::parts::PythonParts;
use crate::rig_state::RigState;
use crate::samples::seconds;
use crate::scenario::ScenarioArgument;
use crate::variable::{VariableFields, variable_fields};

/// A scenario as a rig that is advanced step by step.
#[pyclass(name = "Rig", module = "twinrig._native", frozen, subclass)]
pub(crate) struct PyRig {
    /// None: closed.
    state: Mutex<Option<RigState>>,
    period: SimDuration,
    /// End of the scenario.
    end: SimTime,
    pub(crate) fall: Fall,
    generation: Generation,
    /// Hash of scenario, robot and settings, which a saved state belongs to.
    pub(crate) scenario: [u8; 32],
}

impl PyRig {
    /// Refuses a rig that is a copy made by a fork.
    fn check_process(&self) -> PyResult<()> {
        if self.generation.is_past() {
            return Err(PyRuntimeError::new_err(
                "the rig belongs to the process from which this one was forked: make one here, and restore the saved state of the other",
            ));
        }
        Ok(())
    }

    /// Returns the time `duration` after `now`, or the end of the scenario if that is earlier.
    pub(crate) fn after(&self, now: SimTime, duration: SimDuration) -> PyResult<SimTime> {
        let to = now.checked_add(duration).unwrap_or(SimTime::MAX);
        if now >= self.end && !duration.is_zero() {
            return Err(past_end(to, self.end));
        }
        Ok(to.min(self.end))
    }

    /// Returns the rig for one call, in the process that made it.
    pub(crate) fn lock(&self) -> PyResult<Locked<'_>> {
        self.check_process()?;
        match self.state.try_lock() {
            Ok(guard) => Ok(Locked(guard)),
            // Panics of parts do not reach the lock, so that it is never poisoned.
            Err(TryLockError::Poisoned(guard)) => Ok(Locked(guard.into_inner())),
            Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                "the rig is in use: by another thread, or by the part of it that makes this call",
            )),
        }
    }
}

/// A rig in use by one call.
pub(crate) struct Locked<'a>(MutexGuard<'a, Option<RigState>>);

impl Locked<'_> {
    pub(crate) fn state(&mut self) -> PyResult<&mut RigState> {
        match self.0.as_mut() {
            Some(state) if state.has_panicked => Err(PyRuntimeError::new_err(
                "a part of the rig has panicked: it cannot be used any more",
            )),
            Some(state) => Ok(state),
            None => Err(PyValueError::new_err("the rig is closed")),
        }
    }
}

/// Names of signals.
#[derive(FromPyObject)]
enum Names {
    One(String),
    Several(Vec<String>),
}

#[pymethods]
impl PyRig {
    /// Builds the rig of a scenario, with Python objects as further controllers and plants.
    #[new]
    fn new(
        py: Python<'_>,
        scenario: ScenarioArgument,
        controllers: &Bound<'_, PyDict>,
        plants: &Bound<'_, PyDict>,
        has_fingerprint: bool,
    ) -> PyResult<Self> {
        let parts = PythonParts::new(controllers, plants)?;
        let built = py.detach(|| {
            catch_panic(|| {
                let assembly = scenario.assembly(&parts.registry)?;
                let (scene, rig) = (assembly.scene().clone(), assembly.rig()?);
                Ok((rig, scene, assembly.period(), scenario_key(&assembly)))
            })
        });
        let built = built.map_err(Failure::from);
        let built = built.and_then(|built| built.map_err(|error: TwinError| error.into()));
        let (rig, scene, period, scenario) = built.map_err(|failure| parts.raised(py, &failure))?;
        let file = scene.scenario.file.clone();
        let objects = parts.objects.take();
        let mut state = RigState::new(rig, parts.exceptions, objects, file, has_fingerprint);
        // The events of time 0, so that all signals have a value.
        state.advance_slice(py, SimTime::ZERO)?;
        Ok(Self {
            fall: Fall::new(&scene, &state),
            state: Mutex::new(Some(state)),
            period,
            end: scene.scenario.end(),
            generation: Generation::current(),
            scenario,
        })
    }

    /// Advances to `until` [s], by default by one control period or to the end of the scenario, and
    /// returns the time reached.
    #[pyo3(signature = (*, until = None))]
    fn step(&self, py: Python<'_>, until: Option<f64>) -> PyResult<f64> {
        let mut locked = self.lock()?;
        let state = locked.state()?;
        let now = state.reached;
        let to = match until {
            Some(seconds) => time(seconds)?,
            None => self.after(now, self.period)?,
        };
        if to > self.end {
            return Err(past_end(to, self.end));
        }
        if to < now {
            return Err(PyValueError::new_err(format!(
                "the rig is at {now}, and cannot step back to {to}: restore a saved state"
            )));
        }
        state.advance(py, to)?;
        Ok(seconds(to))
    }

    /// Time reached [s].
    #[getter]
    fn now(&self) -> PyResult<f64> {
        Ok(seconds(self.lock()?.state()?.reached))
    }

    /// Control period [s].
    #[getter]
    fn period(&self) -> f64 {
        self.period.as_secs_f64()
    }

    /// Duration of the scenario [s], beyond which the rig does not step.
    #[getter]
    fn duration(&self) -> f64 {
        seconds(self.end)
    }

    /// Whether the robot is on the ground now, by the thresholds of a fall of the scenario.
    #[getter]
    fn has_fallen(&self) -> PyResult<bool> {
        Ok(self.fall.holds(&self.lock()?.state()?.latest))
    }

    /// Hash of all samples and events since the rig was built, as 64 digits.
    #[getter]
    fn fingerprint(&self) -> PyResult<String> {
        let mut locked = self.lock()?;
        let fingerprint = locked.state()?.fingerprint.as_ref();
        let fingerprint = fingerprint.ok_or_else(|| {
            PyValueError::new_err(
                "the rig has no fingerprint: it was built, or its state saved, with \
                 `fingerprint=False`",
            )
        })?;
        Ok(fingerprint.digest().to_string())
    }

    /// Names of the signals, each with its unit and size.
    fn signals(&self) -> PyResult<Vec<(String, &'static str, usize)>> {
        let mut locked = self.lock()?;
        let mut signals: Vec<(String, &'static str, usize)> = Vec::new();
        for field in locked.state()?.fields() {
            let port = &field.port;
            if signals.iter().all(|(name, ..)| *name != port.name) {
                signals.push((port.name.clone(), port.unit.symbol(), port.size));
            }
        }
        Ok(signals)
    }

    /// Newest values of a signal, or of several one after the other, as a new array.
    fn read<'py>(&self, py: Python<'py>, names: Names) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut locked = self.lock()?;
        let state = locked.state()?;
        let mut values = Vec::new();
        match &names {
            Names::One(name) => values.extend_from_slice(state.newest(name)?),
            Names::Several(names) => {
                for name in names {
                    values.extend_from_slice(state.newest(name)?);
                }
            }
        }
        Ok(values.into_pyarray(py))
    }

    /// Replaces an output of the controller from its next iteration on; None ends the
    /// replacement.
    #[pyo3(signature = (name, values))]
    fn write(&self, name: &str, values: Option<PyReadonlyArray1<'_, f64>>) -> PyResult<()> {
        let mut locked = self.lock()?;
        let state = locked.state()?;
        let values = values.as_ref().map(PyReadonlyArray1::as_slice).transpose();
        let values = values.map_err(|error| PyValueError::new_err(error.to_string()))?;
        state.rig.override_output(name, values).map_err(refused)
    }

    /// Sets a process variable, in its unit, before the next control step.
    fn set_variable(&self, name: &str, value: f64) -> PyResult<()> {
        let mut locked = self.lock()?;
        let state = locked.state()?;
        let (rig, now) = (&mut state.rig, state.reached);
        rig.schedule(now, name, Change::To(value)).map_err(refused)
    }

    /// Names of the process variables, each with its unit, present, least and greatest value.
    fn variables(&self) -> PyResult<Vec<VariableFields>> {
        let mut locked = self.lock()?;
        let variables = locked.state()?.rig.process().variables().iter();
        Ok(variables.map(variable_fields).collect())
    }

    /// Complete state of the rig, for `restore` of a rig of the same scenario and build.
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut locked = self.lock()?;
        let state = locked.state()?;
        Ok(PyBytes::new(py, &state.save(&self.scenario)?))
    }

    /// Restores a saved state, with the fingerprint of all before it.
    fn restore(&self, state: &[u8]) -> PyResult<()> {
        self.lock()?.state()?.restore(state, &self.scenario)
    }

    /// Closes the rig; every later call but this one raises `ValueError`.
    pub(crate) fn close(&self) -> PyResult<()> {
        let state = self.lock()?.0.take();
        // Finalizers of parts, which may use the rig, find it closed.
        drop(state);
        Ok(())
    }

    /// Reports the objects of the parts to the garbage collector: one may refer to the rig.
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        // A rig in use is not garbage, so that its objects need not be reported.
        let guard = self.state.try_lock();
        let state = guard.as_ref().ok().and_then(|state| state.as_ref());
        let mut objects = state.into_iter().flat_map(|state| &state.objects);
        objects.try_for_each(|object| visit.call(&**object))
    }

    fn __clear__(&self) {
        let state = self
            .state
            .try_lock()
            .ok()
            .and_then(|mut state| state.take());
        drop(state);
    }
}

/// Returns a hash of scenario, robot and settings.
fn scenario_key(assembly: &Assembly<'_>) -> [u8; 32] {
    let scenario = assembly.scenario();
    let robot = assembly.robot_file().map_or("", |(_, text)| text);
    let settings = scenario.settings.iter();
    let settings = settings.flat_map(|setting| [&*setting.key, &*setting.value]);
    let mut digest = Fingerprint::new();
    for text in [&*scenario.text, robot].into_iter().chain(settings) {
        digest.wire(0, 0, text.as_bytes());
    }
    *digest.digest().as_bytes()
}

/// Returns the time at `seconds`, to the nearest nanosecond.
pub(crate) fn time(seconds: f64) -> PyResult<SimTime> {
    let duration = SimDuration::try_from_secs_f64(seconds);
    let time = duration.and_then(|duration| SimTime::ZERO.checked_add(duration));
    time.ok_or_else(|| no_time(seconds))
}

pub(crate) fn no_time(seconds: f64) -> PyErr {
    PyValueError::new_err(format!("{seconds} s is no simulated time: 0 to 584 years"))
}

/// Returns the exception for a step past the end of the scenario.
fn past_end(to: SimTime, end: SimTime) -> PyErr {
    PyValueError::new_err(format!(
        "the scenario ends at {end}, before {to}: build the rig with `set={{\"duration\": …}}`"
    ))
}

/// Returns the exception for a request that the rig refuses.
#[expect(clippy::needless_pass_by_value, reason = "for `map_err`")]
pub(crate) fn refused(error: RigError) -> PyErr {
    let text = error.to_string();
    match error {
        RigError::NoSuchVariable { .. } | RigError::NoSuchOutput { .. } => {
            PyKeyError::new_err(text)
        }
        _ => PyValueError::new_err(text),
    }
}
