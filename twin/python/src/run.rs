//! Runs in virtual time.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use twinrig::{Assembly, Execution, Report, execute_observed, recording_path, with_ensemble};

use crate::errors::Failure;
use crate::parts::PythonParts;
use crate::poll::SignalPoll;
use crate::samples::{RunData, SampleStore};
use crate::scenario::ScenarioArgument;
use crate::supervised::{in_place, supervised};

/// Output of a run that has started.
struct RunOutput {
    report: Report,
    /// Code and text of each warning about the scenario.
    warnings: Vec<(&'static str, String)>,
    data: RunData,
}

/// Runs a scenario and keeps its signals.
///
/// `recording` is the path of the recording and whether it is that of a folder, in which the file
/// has the name that the program gives it; `None`: nothing is recorded.
///
/// Returns `report` (JSON), `table`, `warnings` (code and text), `groups` (name, signals, times
/// \[s\], values row by row), `footsteps`, `frames`, and `interrupt`: the exception of a signal
/// handler or of a Python part that ended the run, or `None`.
#[pyfunction]
#[expect(
    clippy::needless_pass_by_value,
    reason = "arguments of Python are extracted into values"
)]
pub(crate) fn run<'py>(
    py: Python<'py>,
    scenario: ScenarioArgument,
    recording: Option<(PathBuf, bool)>,
    controllers: &Bound<'py, PyDict>,
    plants: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyDict>> {
    let parts = PythonParts::new(controllers, plants)?;
    let work = || execute(&scenario, recording, &parts);
    let mut done = if parts.any {
        // Python parts run on the thread of the caller, where signals reach them.
        in_place(py, work)
    } else {
        supervised(py, work)?
    };
    done.interrupt = parts.exceptions.take().or(done.interrupt);
    let output = done.result.map_err(Failure::from);
    let output = output.and_then(|output| output);
    let (output, interrupt) = match (output, done.interrupt) {
        (Ok(output), interrupt) => (output, interrupt),
        // Interrupted before the run has started.
        (Err(_), Some(interrupt)) => return Err(interrupt),
        (Err(failure), None) => return Err(failure.raised(py)),
    };
    let dict = PyDict::new(py);
    // Serialisation fails only for keys that are not strings.
    let report = serde_json::to_string(&output.report).unwrap_or_default();
    dict.set_item("report", report)?;
    dict.set_item("table", twinrig::text(&output.report))?;
    dict.set_item("warnings", output.warnings)?;
    dict.set_item("interrupt", interrupt)?;
    output.data.add_to(&dict)?;
    Ok(dict)
}

fn execute(
    scenario: &ScenarioArgument,
    recording: Option<(PathBuf, bool)>,
    parts: &PythonParts,
) -> Result<RunOutput, Failure> {
    let assembly = scenario.assembly(&parts.registry)?;
    let execution = Execution {
        recording: recording.map(|(path, is_folder)| recorded_at(&assembly, path, is_folder)),
        ..Execution::default()
    };
    let poll = parts.any.then(|| SignalPoll::new(&parts.exceptions));
    let mut store = SampleStore::new(&assembly, poll);
    let report = execute_observed(&assembly, &execution, &mut store)?;
    // Python parts run on the thread of the caller, and so without an ensemble.
    let report = if parts.any {
        report
    } else {
        with_ensemble(&assembly, report, &mut |_, _| ())?
    };
    if let Some(bytes) = store.missing {
        return Err(Failure::Memory { bytes });
    }
    // Warnings about the size of a recording are in the report only if there is one.
    let warnings = &assembly.scenario().warnings;
    let codes: Vec<&str> = report.warnings.iter().map(|warned| warned.code).collect();
    let warnings = warnings
        .iter()
        .filter(|warning| codes.contains(&warning.code));
    let warnings = warnings.map(|warning| (warning.code, warning.to_string()));
    Ok(RunOutput {
        warnings: warnings.collect(),
        data: store.finish(),
        report,
    })
}

fn recorded_at(assembly: &Assembly<'_>, path: PathBuf, is_folder: bool) -> PathBuf {
    if is_folder {
        recording_path(&path, assembly.scenario())
    } else {
        path
    }
}
