//! The scenario files of the repository.

use std::path::{Path, PathBuf};

/// The folder of the scenarios.
pub fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios")
}

/// The scenario files in `below`, a folder in that folder, in order of their names.
///
/// # Panics
/// If there is no such folder.
pub fn scenarios_in(below: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(scenarios().join(below)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| {
        path.extension()
            .is_some_and(|extension| extension == "toml")
    });
    paths.sort();
    paths
}
