//! A rig with its observers, behind the class `Rig`.

use std::ops::Range;

use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use twinrig::Error;
use twinrig::kernel::{Field, Layout, SimDuration, SimTime, Snapshot, near_misses};
use twinrig::runtime::{Group, Observer, PanicReport, Rig, RigError, RunEvent, catch_panic};
use twinrig_record::Fingerprint;

use crate::errors::{self, Failure};
use crate::exceptions::Exceptions;
use crate::part_objects::SharedObject;
use crate::poll::Poll;

/// Simulated time between two polls of Python's signals, in a long step.
pub(crate) const SLICE: SimDuration = SimDuration::from_millis(100);

/// Signals of all groups, in the order in which a name is looked up.
pub(crate) const GROUPS: [Group; 4] = [
    Group::Plant,
    Group::ProcessInputs,
    Group::ProcessOutputs,
    Group::Diagnostics,
];

/// Observer with the newest values of each group.
pub(crate) struct Latest(pub(crate) [Vec<f64>; 4]);

/// Group of a signal, and its range in the values of the group.
pub(crate) type Place = (Group, Range<usize>);

impl Latest {
    /// Returns the values of a signal.
    pub(crate) fn values(&self, (group, range): &Place) -> &[f64] {
        &self.0[*group as usize][range.clone()]
    }
}

impl Observer for Latest {
    fn samples(&mut self, _: SimTime, group: Group, values: &[f64]) {
        self.0[group as usize].copy_from_slice(values);
    }
    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

/// Saved state: time reached, newest values of each group and the fingerprint, the rig.
type SavedState = (SimTime, ([Vec<f64>; 4], Option<Fingerprint>), Snapshot);

/// Result of a run up to a time.
pub(crate) type RunOutcome = Result<Result<(), RigError>, PanicReport>;

/// A rig with its observers.
pub(crate) struct RigState {
    pub(crate) rig: Rig,
    /// None: samples and events are not hashed.
    pub(crate) fingerprint: Option<Fingerprint>,
    /// Whether a fingerprint of a restored state is continued.
    has_fingerprint: bool,
    pub(crate) latest: Latest,
    /// Those of its Python parts.
    pub(crate) exceptions: Exceptions,
    /// Objects of its Python parts.
    pub(crate) objects: Vec<SharedObject>,
    file: String,
    /// Simulated time up to which all events have been handled.
    pub(crate) reached: SimTime,
    /// Whether a part has panicked: the state is then invalid, and no part is called again.
    pub(crate) has_panicked: bool,
}

impl RigState {
    pub(crate) fn new(
        rig: Rig,
        exceptions: Exceptions,
        objects: Vec<SharedObject>,
        file: String,
        has_fingerprint: bool,
    ) -> Self {
        let latest = GROUPS.map(|group| vec![0.0; rig.layout(group).len()]);
        Self {
            rig,
            fingerprint: has_fingerprint.then(Fingerprint::new),
            has_fingerprint,
            latest: Latest(latest),
            exceptions,
            objects,
            file,
            reached: SimTime::ZERO,
            has_panicked: false,
        }
    }

    /// Returns the exception for an error of the rig: that of a Python part, if it is the cause.
    fn raised(&self, error: RigError) -> PyErr {
        let exception = self.exceptions.take();
        exception.unwrap_or_else(|| {
            let error = Error::Rig {
                file: self.file.clone(),
                help: String::new(),
                source: Box::new(error),
            };
            Python::attach(|py| errors::twin_error(py, error.to_string()))
        })
    }

    /// Advances to `to` without the interpreter, and polls its signals in between.
    pub(crate) fn advance(&mut self, py: Python<'_>, to: SimTime) -> PyResult<()> {
        // A short step leaves the signals to the interpreter, and reads no clock.
        let is_long = self
            .reached
            .checked_add(SLICE)
            .is_some_and(|next| next < to);
        let mut poll = is_long.then(Poll::new);
        while self.reached < to {
            let slice = self.reached.checked_add(SLICE);
            self.advance_slice(py, slice.map_or(to, |next| next.min(to)))?;
            if let Some(poll) = &mut poll {
                poll.signals(py)?;
            }
        }
        Ok(())
    }

    /// Advances to `to`, which may be the present time: to the events that are due at once.
    pub(crate) fn advance_slice(&mut self, py: Python<'_>, to: SimTime) -> PyResult<()> {
        let outcome = py.detach(|| self.run_until(to));
        self.finish(to, outcome)
    }

    /// Runs without the interpreter.
    pub(crate) fn run_until(&mut self, to: SimTime) -> RunOutcome {
        let Self {
            rig,
            fingerprint,
            latest,
            ..
        } = self;
        catch_panic(|| match fingerprint {
            Some(fingerprint) => rig.run_until(to, &mut (fingerprint, latest)),
            None => rig.run_until(to, latest),
        })
    }

    /// Returns the result of a run to `to`.
    pub(crate) fn finish(&mut self, to: SimTime, outcome: RunOutcome) -> PyResult<()> {
        match outcome {
            Ok(Ok(())) => {
                self.reached = to;
                self.exceptions.take().map_or(Ok(()), Err)
            }
            Ok(Err(error)) => {
                self.reached = self.rig.now();
                Err(self.raised(error))
            }
            Err(source) => Err(self.panicked(source)),
        }
    }

    /// Returns the exception for a panic of a part.
    fn panicked(&mut self, source: PanicReport) -> PyErr {
        self.has_panicked = true;
        let file = self.file.clone();
        let failure = Failure::from(Error::Panic { file, source });
        Python::attach(|py| failure.raised(py))
    }

    /// Returns the complete state, which belongs to the scenario with the hash `scenario`.
    pub(crate) fn save(&mut self, scenario: &[u8; 32]) -> PyResult<Vec<u8>> {
        let saved = catch_panic(|| {
            let observed = (&self.latest.0, &self.fingerprint);
            Snapshot::of(&(self.reached, observed, self.rig.save()))
        });
        let saved = saved.map_err(|source| self.panicked(source))?;
        match self.exceptions.take() {
            Some(exception) => Err(exception),
            None => Ok(saved.checked(scenario)),
        }
    }

    /// Restores a saved state of the scenario with the hash `scenario`.
    pub(crate) fn restore(&mut self, saved: &[u8], scenario: &[u8; 32]) -> PyResult<()> {
        let saved = Snapshot::verified(saved, scenario).map_err(|_| {
            PyValueError::new_err(
                "the bytes were changed, cut off, or saved of a rig of another scenario, robot, \
                 setting or build",
            )
        })?;
        let saved = saved.read::<SavedState>();
        let (reached, (latest, fingerprint), rig) =
            saved.map_err(|error| PyValueError::new_err(error.to_string()))?;
        let lengths = |groups: &[Vec<f64>; 4]| groups.each_ref().map(Vec::len);
        if lengths(&latest) != lengths(&self.latest.0) {
            return Err(PyValueError::new_err(
                "the state was saved of a rig with other signals",
            ));
        }
        let restored = catch_panic(|| self.rig.restore(&rig));
        let restored = restored.map_err(|source| self.panicked(source))?;
        restored.map_err(|error| {
            let exception = self.exceptions.take();
            exception.unwrap_or_else(|| PyValueError::new_err(error.to_string()))
        })?;
        self.reached = reached;
        self.fingerprint = fingerprint.filter(|_| self.has_fingerprint);
        self.latest = Latest(latest);
        Ok(())
    }

    /// Returns the place of a signal; none if there is no such signal.
    pub(crate) fn place(&self, name: &str) -> Option<Place> {
        let place = |group| Some((group, self.rig.layout(group).find(name)?));
        GROUPS.into_iter().find_map(place)
    }

    /// Returns the place of a signal that is read.
    pub(crate) fn known_place(&self, name: &str) -> PyResult<Place> {
        self.place(name).ok_or_else(|| {
            let known = self.fields().map(|field| field.port.name.as_str());
            PyKeyError::new_err(no_such_signal(name, known))
        })
    }

    /// Returns the newest values of a signal.
    pub(crate) fn newest(&self, name: &str) -> PyResult<&[f64]> {
        Ok(self.latest.values(&self.known_place(name)?))
    }

    /// Returns the signals of all groups.
    pub(crate) fn fields(&self) -> impl Iterator<Item = &Field> {
        let layouts = GROUPS.into_iter().map(|group| self.rig.layout(group));
        layouts.flat_map(Layout::fields)
    }
}

fn no_such_signal<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let near = near_misses(name, known);
    let help = match near.as_slice() {
        [] => String::new(),
        near => format!("; did you mean `{}`?", near.join("` or `")),
    };
    format!("there is no signal `{name}`{help}")
}
