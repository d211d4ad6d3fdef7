//! Scenario files of the repository.

use std::path::{Path, PathBuf};

/// Folder of the scenarios.
pub fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios")
}

/// Returns the scenario files in the subfolder `below`, sorted by name.
///
/// # Panics
/// If the folder does not exist.
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
