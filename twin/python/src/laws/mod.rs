//! Laws of drivers in Python with emulated devices in Python: those of `twinrig_testing::laws`, on
//! cases that Python has drawn.

mod case;
mod device;
mod driver;
mod setup;
mod values;

pub(crate) use case::case_ranges;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use twinrig::runtime::catch_panic;
use twinrig_testing::laws;

use crate::errors::twin_error;
use crate::exceptions::Exceptions;
use case::CaseArgument;

/// Checks whether a law holds in a case.
///
/// Returns None, or the instant \[ns\] and the text of its violation.
///
/// # Errors
/// The exception of the driver or a device, and that of a setup that is not suitable.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "arguments of Python are extracted into values"
)]
pub(crate) fn check_law(
    name: &str,
    setup: &Bound<'_, PyAny>,
    case: CaseArgument,
) -> PyResult<Option<(u64, String)>> {
    let law = laws::all().into_iter().find(|(known, _)| *known == name);
    let (_, law) = law.ok_or_else(|| PyValueError::new_err(format!("there is no law `{name}`")))?;
    let case = case.case()?;
    let exceptions = Exceptions::default();
    let checked = setup::read_setup(setup, &exceptions)
        .map(|setup| catch_panic(|| law(&setup, &case).map_err(|it| (it.at.as_nanos(), it.what))));
    // What follows an exception is a consequence of it.
    if let Some(exception) = exceptions.take() {
        return Err(exception);
    }
    match checked? {
        Ok(held) => Ok(held.err()),
        Err(panic) => {
            let why = format!("`{name}` cannot be checked: {}", panic.message);
            Err(twin_error(setup.py(), why))
        }
    }
}

/// Checks a setup: reads it, and makes its driver and its devices once.
///
/// # Errors
/// An exception that names the argument.
#[pyfunction]
pub(crate) fn check_setup(setup: &Bound<'_, PyAny>) -> PyResult<()> {
    setup::read_setup(setup, &Exceptions::default()).map(|_| ())
}
