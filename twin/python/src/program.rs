//! The program `twin` and its commands.

use std::ffi::OsString;
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use twinrig::{run_args, run_with};

use crate::errors::{Failure, twin_error};
use crate::exceptions::Exceptions;
use crate::fork::Generation;
use crate::registry::registry;
use crate::supervised::supervised;

/// Generation of the process in which a study has started the threads that all swarms share.
static THREADS: Mutex<Option<Generation>> = Mutex::new(None);

/// Command with several threads.
const STUDY: &str = "study";

/// Runs the program with command-line arguments and returns its exit code. It handles SIGINT and
/// SIGTERM itself, so the process must belong to it.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| run_args(&registry(&Exceptions::default()), arguments))
}

/// Runs a command of the program; returns exit code, standard output and standard error.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, arguments: Vec<OsString>) -> PyResult<(u8, String, String)> {
    if arguments.first().is_some_and(|name| name == STUDY) {
        check_threads(py)?;
    }
    let done = supervised(py, || {
        let registry = registry(&Exceptions::default());
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let code = run_with(&registry, arguments, &mut out, &mut err);
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        (code, text(out), text(err))
    })?;
    match done.interrupt {
        Some(interrupt) => Err(interrupt),
        None => done.result.map_err(|panic| Failure::from(panic).raised(py)),
    }
}

/// Refuses to wait for threads that a fork has not inherited.
fn check_threads(py: Python<'_>) -> PyResult<()> {
    if have_threads() {
        return Ok(());
    }
    let message = "this process was forked after a study had started threads, which it does not have: start processes by `spawn` (multiprocessing.get_context(\"spawn\"))";
    Err(twin_error(py, message.to_owned()))
}

/// Whether this process has, or will have, the threads. The lock is not held while Python runs:
/// another thread could wait for it with the interpreter.
fn have_threads() -> bool {
    let mut started = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    !started.get_or_insert_with(Generation::current).is_past()
}
