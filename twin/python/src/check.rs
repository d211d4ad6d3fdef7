//! Checks and plans of scenarios, without a run.

use pyo3::prelude::*;
use twinrig::plan_json;

use crate::errors::Failure;
use crate::exceptions::Exceptions;
use crate::registry::registry;
use crate::scenario::ScenarioArgument;
use crate::supervised::supervised;

/// Builds the parts of a scenario.
///
/// Returns its name and, for each warning, its code, text, file and line.
#[pyfunction]
#[expect(
    clippy::type_complexity,
    reason = "a tuple of Python values, described in `_native.pyi`"
)]
pub(crate) fn check(
    py: Python<'_>,
    scenario: ScenarioArgument,
) -> PyResult<(String, Vec<(&'static str, String, String, Option<usize>)>)> {
    let checked = inspected(py, move || {
        let registry = registry(&Exceptions::default());
        let assembly = scenario.assembly(&registry)?;
        assembly.rig()?;
        let scenario = assembly.scenario();
        let warned = scenario.warnings.iter().map(|warning| {
            let problem = &warning.problem;
            let line = problem.place.as_ref().map(twinrig_document::Place::line);
            let text = warning.to_string();
            (warning.code, text, problem.file.clone(), line)
        });
        Ok((scenario.name.clone(), warned.collect()))
    })?;
    Ok(checked)
}

/// Returns the plan of a scenario as JSON.
#[pyfunction]
pub(crate) fn plan(py: Python<'_>, scenario: ScenarioArgument) -> PyResult<String> {
    inspected(py, move || {
        let registry = registry(&Exceptions::default());
        let assembly = scenario.assembly(&registry)?;
        Ok(plan_json(&registry, &assembly)?)
    })
}

/// Does `work` with the interpreter released.
fn inspected<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<R, Failure> + Send,
) -> PyResult<R> {
    let done = supervised(py, work)?;
    if let Some(interrupt) = done.interrupt {
        return Err(interrupt);
    }
    let result = done.result.map_err(Failure::from).and_then(|result| result);
    result.map_err(|failure| failure.raised(py))
}
