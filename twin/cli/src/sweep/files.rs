//! Files of the result of a sweep.

use std::path::{Path, PathBuf};

use twinrig_campaign::sweep::SweepResult;

use crate::error::TwinError;

/// Writes `rows.csv`, `sweep.json` and `report.html` into a folder; returns their paths.
pub(super) fn write(result: &SweepResult, folder: &Path) -> Result<Vec<PathBuf>, TwinError> {
    let texts = [
        ("rows.csv", result.csv()),
        ("sweep.json", format!("{:#}\n", result.json())),
        ("report.html", twinrig_study::sweep_page(result)),
    ];
    let written = texts.into_iter().map(|(name, text)| {
        let path = folder.join(name);
        replace(&path, &text).map_err(|source| TwinError::Write {
            path: path.clone(),
            source,
        })?;
        Ok(path)
    });
    written.collect()
}

/// Writes a file completely or not at all: a reader never finds a part of it.
fn replace(path: &Path, text: &str) -> std::io::Result<()> {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}", std::process::id()));
    let beside = PathBuf::from(name);
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&beside);
    }
    written
}
