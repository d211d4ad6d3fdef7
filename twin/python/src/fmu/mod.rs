//! Functional mock-up units as plants.
//!
//! The Python half (`twinrig._fmu`) reads and steps an FMU; it does not know signals. This half
//! maps the signals of a scenario to variables, converts units, and drives a worker over a
//! [`link`]: pipes to a process of its own, or calls in this process.
//!
//! A worker holds one FMU behind requests and replies that are bytes. One advance is one round
//! trip: time, step and inputs there, outputs back. The worker that has described an FMU serves the
//! first plant built from it. A process ends with its pipe: a thread of it waits for the end of the
//! parent, also in the midst of a call. The limit of a call is the machine's clock: it may end a
//! run, and changes no value of it. Programs that were not started from the Python package list the
//! plant `fmu` with the remedy (`Registry::without_plant`).

mod description;
mod failure;
mod folder;
mod link;
mod model;
mod parameters;
mod plant;
mod process;
mod signals;
mod units;

use pyo3::prelude::*;
use twinrig::PlantKind;
use twinrig::fmu_plant::{ABOUT, NAME, options};

use crate::exceptions::Exceptions;
use crate::fmu::model::FmuModel;

/// Returns the kind of plants that are FMUs; none if the package that reads them is not installed.
/// `exceptions` takes those of signal handlers while an FMU is awaited.
pub(crate) fn kind(exceptions: &Exceptions) -> Option<PlantKind> {
    if !Python::attach(|py| is_installed(py).unwrap_or(false)) {
        return None;
    }
    let exceptions = exceptions.clone();
    let kind = PlantKind::standalone(NAME, ABOUT, move |context| {
        FmuModel::load(context, &exceptions)
    });
    let kind = options().into_iter().fold(kind, PlantKind::with_option);
    Some(kind.with_robot_keys())
}

fn is_installed(py: Python<'_>) -> PyResult<bool> {
    let find = py.import("importlib.util")?.getattr("find_spec")?;
    Ok(!find.call1(("fmpy",))?.is_none())
}
