//! Reading of recordings.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use twinrig::Error;
use twinrig_record::{FootstepMessage, RecordError, Recording, VerdictMessage};

use crate::errors::Failure;
use crate::samples::{Footsteps, RunData, Samples, seconds};
use crate::supervised::supervised;

/// Contents of a recording.
struct Contents {
    data: RunData,
    verdict: Option<VerdictMessage>,
    recording: Recording,
}

/// Reads a recording.
///
/// Returns `groups`, `footsteps` and `frames` as [`crate::run::run`] does, `verdict` (JSON or
/// `None`), `notes`, `files` (name and contents of the input files), `complete`, `fingerprint`,
/// `seed` and `reached_s`.
#[pyfunction]
pub(crate) fn read(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let done = supervised(py, || {
        let contents = contents(&path);
        contents.map_err(|source| Error::Record { path, source })
    })?;
    if let Some(interrupt) = done.interrupt {
        return Err(interrupt);
    }
    let contents = done.result.map_err(Failure::from);
    let contents = contents.and_then(|contents| contents.map_err(Failure::from));
    let contents = contents.map_err(|failure| failure.raised(py))?;
    let recording = &contents.recording;
    let dict = PyDict::new(py);
    let verdict = contents.verdict.as_ref();
    // Serialisation fails only for keys that are not strings.
    let verdict = verdict.map(|verdict| serde_json::to_string(verdict).unwrap_or_default());
    dict.set_item("verdict", verdict)?;
    dict.set_item("notes", recording.notes().collect::<Vec<_>>())?;
    let files = recording.attachments();
    let files = files.map(|(name, bytes)| (name, PyBytes::new(py, bytes)));
    dict.set_item("files", files.collect::<Vec<_>>())?;
    dict.set_item("complete", recording.is_complete())?;
    dict.set_item("fingerprint", recording.fingerprint())?;
    dict.set_item("seed", recording.seed())?;
    dict.set_item("reached_s", recording.reached().map(seconds))?;
    contents.data.add_to(&dict)?;
    Ok(dict)
}

fn contents(path: &Path) -> Result<Contents, RecordError> {
    let recording = Recording::open(path)?;
    let mut footsteps = Footsteps::default();
    for (_, message) in recording.messages::<FootstepMessage>()? {
        footsteps.push_message(&message);
    }
    let groups = recording.groups().iter();
    let data = RunData {
        groups: groups
            .map(|group| Samples::read(&recording, group))
            .collect(),
        footsteps,
        frames: recording.frames()?,
    };
    let verdict = recording.messages::<VerdictMessage>()?.pop();
    Ok(Contents {
        data,
        verdict: verdict.map(|(_, verdict)| verdict),
        recording,
    })
}
