//! Exceptions of Python parts: each is kept until the call that runs the parts raises it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;

/// The first exception of the Python parts of a rig. Clones share it.
///
/// A part cannot raise through the rig: it reports a fault, which ends the run, and leaves the
/// exception here.
#[derive(Clone, Default)]
pub(crate) struct Exceptions(Arc<Mutex<Option<PyErr>>>);

impl Exceptions {
    /// Keeps an exception, unless there is an earlier one, and returns its text.
    pub(crate) fn keep(&self, py: Python<'_>, exception: PyErr) -> String {
        let text = text(py, &exception);
        self.kept().get_or_insert(exception);
        text
    }

    /// Whether there is one.
    pub(crate) fn any(&self) -> bool {
        self.kept().is_some()
    }

    /// Takes the exception, if there is one.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.kept().take()
    }

    fn kept(&self) -> MutexGuard<'_, Option<PyErr>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Type and message of an exception, in one line: `ValueError: no table`.
fn text(py: Python<'_>, exception: &PyErr) -> String {
    let kind = exception.get_type(py);
    let name = kind
        .name()
        .map_or_else(|_| "exception".to_owned(), |name| name.to_string());
    let message = exception.value(py).str().map(|text| text.to_string());
    match message {
        Ok(message) if !message.is_empty() => format!("{name}: {message}"),
        _ => name,
    }
}
