//! Processes of this interpreter with this package.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use pyo3::prelude::*;

/// Interpreter, and the folders where it finds packages.
#[derive(Clone, Debug)]
pub(crate) struct Interpreter {
    executable: PathBuf,
    paths: OsString,
}

impl Interpreter {
    /// Returns that of this process.
    pub(crate) fn current(py: Python<'_>) -> PyResult<Self> {
        let sys = py.import("sys")?;
        let known: Vec<PathBuf> = sys.getattr("path")?.extract()?;
        // An empty entry is the current folder, which may be another one for the process.
        let absolute = known.iter().map(std::path::absolute);
        let mut paths: Vec<PathBuf> = absolute.filter_map(Result::ok).collect();
        // The package may be in a folder that is no longer in the list.
        let file: PathBuf = py.import("twinrig")?.getattr("__file__")?.extract()?;
        let folder = file.ancestors().nth(2).map(Path::to_owned);
        if let Some(folder) = folder.filter(|folder| !paths.contains(folder)) {
            paths.insert(0, folder);
        }
        Ok(Self {
            executable: sys.getattr("executable")?.extract()?,
            paths: std::env::join_paths(paths).unwrap_or_default(),
        })
    }

    /// Returns the command `python -m MODULE`, which finds the packages of this process.
    pub(crate) fn module(&self, name: &str) -> Command {
        let mut command = Command::new(&self.executable);
        command.args(["-m", name]).env("PYTHONPATH", &self.paths);
        command
    }
}
