//! Values of Python that laws read: what methods return, attributes, times.

use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyString;
use twinrig::kernel::SimDuration;
use twinrig_document::parse_duration;

/// Reads a value; `name` is that of the method that has returned it, or of the attribute.
///
/// # Errors
/// `TypeError` with the value and what was expected.
pub(super) fn read<'py, T: FromPyObjectOwned<'py>>(
    value: &Bound<'py, PyAny>,
    name: &str,
    expected: &str,
) -> PyResult<T> {
    value.extract().or_else(|_| {
        let found = value.repr()?;
        let message = format!("`{name}` is {found}: expected {expected}");
        Err(PyTypeError::new_err(message))
    })
}

/// Reads a duration: whole nanoseconds, or a text with its unit; none if it is `None`.
///
/// # Errors
/// `TypeError` and `ValueError`, which name it.
pub(super) fn duration(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Option<SimDuration>> {
    if value.is_none() {
        return Ok(None);
    }
    let duration = if value.is_instance_of::<PyString>() {
        parse_duration(&value.extract::<String>()?)
            .map_err(|error| PyValueError::new_err(format!("{name}: {}", error.message)))?
    } else {
        SimDuration::from_nanos(read(
            value,
            name,
            "a text as \"87 us\", or whole nanoseconds",
        )?)
    };
    if duration == SimDuration::ZERO {
        return Err(PyValueError::new_err(format!("{name}: 0 is too short")));
    }
    Ok(Some(duration))
}
