//! Job of another process, done by a worker of a cluster.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use twinrig::WorkerJob;
use twinrig::runtime::catch_panic;

use crate::errors::{Failure, twin_error};
use crate::exceptions::Exceptions;
use crate::registry::registry;
use crate::supervised::supervised;

/// Result of a task; none after an interrupt.
type TaskOutcome<'py> = Option<(bool, Bound<'py, PyBytes>)>;

/// Job on a worker.
#[pyclass(name = "WorkerJob", module = "twinrig._native", frozen)]
pub(crate) struct PyWorkerJob(WorkerJob);

#[pymethods]
impl PyWorkerJob {
    /// Reads the shared data of a job.
    #[new]
    fn new(py: Python<'_>, shared: &[u8]) -> PyResult<Self> {
        let job = WorkerJob::new(registry(&Exceptions::default()), shared);
        let job = job.map_err(|error| twin_error(py, error.to_string()))?;
        Ok(Self(job))
    }

    /// Does tasks; returns for each whether it ended without a panic, and its result or the panic.
    fn run<'py>(&self, py: Python<'py>, tasks: Vec<Vec<u8>>) -> PyResult<Vec<TaskOutcome<'py>>> {
        let run = |task: Vec<u8>| match catch_panic(|| self.0.run(&task)) {
            Ok(Ok(result)) => Ok(result.map(|result| (true, result))),
            Ok(Err(error)) => Err(error.to_string()),
            Err(panic) => Ok(Some((false, panic.to_string().into_bytes()))),
        };
        let done = supervised(py, || {
            tasks.into_iter().map(run).collect::<Result<Vec<_>, _>>()
        })?;
        if let Some(interrupt) = done.interrupt {
            return Err(interrupt);
        }
        let ended = done
            .result
            .map_err(|panic| Failure::from(panic).raised(py))?;
        let ended = ended.map_err(|error| twin_error(py, error))?.into_iter();
        let python = |(sound, bytes): (bool, Vec<u8>)| (sound, PyBytes::new(py, &bytes));
        Ok(ended.map(|one| one.map(python)).collect())
    }
}
