//! Conversion of errors to the exceptions of the package.

use pyo3::prelude::*;
use twinrig::runtime::PanicReport;
use twinrig::{Error, ExperimentError, TwinError};
use twinrig_document::{Place, Problem};

/// Module with the exceptions.
const ERRORS: &str = "twinrig._errors";

/// Failure of an operation before it is a Python exception.
pub(crate) enum Failure {
    /// Error of the crate `twinrig`.
    Twin(Box<TwinError>),
    /// Insufficient memory for the signals of a run.
    Memory {
        /// Requested room \[bytes\].
        bytes: usize,
    },
}

impl From<TwinError> for Failure {
    fn from(error: TwinError) -> Self {
        Self::Twin(Box::new(error))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        TwinError::from(error).into()
    }
}

impl From<ExperimentError> for Failure {
    fn from(error: ExperimentError) -> Self {
        TwinError::from(error).into()
    }
}

impl From<PanicReport> for Failure {
    fn from(source: PanicReport) -> Self {
        let file = String::new();
        Error::Panic { file, source }.into()
    }
}

impl Failure {
    /// Returns the exception.
    pub(crate) fn raised(&self, py: Python<'_>) -> PyErr {
        match self {
            Self::Twin(error) => exception(py, error).unwrap_or_else(|failed| failed),
            Self::Memory { bytes } => pyo3::exceptions::PyMemoryError::new_err(format!(
                "the signals of this run need {} MB: keep fewer (signals=[…]), observe less often ([observe] period), or record them (record=…, signals=[])",
                bytes / 1_000_000
            )),
        }
    }
}

/// Returns the base exception of the package with a message.
pub(crate) fn twin_error(py: Python<'_>, message: String) -> PyErr {
    let class = py
        .import(ERRORS)
        .and_then(|module| module.getattr("TwinError"));
    let raised = class.and_then(|class| class.call1((message,)));
    raised.map_or_else(|failed| failed, PyErr::from_value)
}

fn exception(py: Python<'_>, error: &TwinError) -> PyResult<PyErr> {
    let module = py.import(ERRORS)?;
    let message = error.to_string();
    let raised = match error {
        TwinError::Rig(Error::Document(error)) => {
            let problems = error.problems.iter().map(|one| problem(&module, one));
            let problems = problems.collect::<PyResult<Vec<_>>>()?;
            module.getattr("ScenarioError")?.call1((message, problems))
        }
        TwinError::Rig(Error::Build { .. } | Error::Rig { .. } | Error::NoSuchBus { .. }) => {
            module.getattr("ScenarioError")?.call1((message,))
        }
        TwinError::Rig(Error::Record { .. })
        | TwinError::Compare { .. }
        | TwinError::NotReplayable { .. } => module.getattr("RecordingError")?.call1((message,)),
        _ => module.getattr("TwinError")?.call1((message,)),
    };
    Ok(PyErr::from_value(raised?))
}

/// Returns a problem as an object of the package.
fn problem<'py>(module: &Bound<'py, PyModule>, one: &Problem) -> PyResult<Bound<'py, PyAny>> {
    let place = one.place.as_ref();
    module.getattr("Problem")?.call1((
        &one.file,
        place.map(Place::line),
        place.map(Place::column),
        &one.message,
        &one.help,
    ))
}
