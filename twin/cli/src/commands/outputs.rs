//! Checks before a run that output files can be written, which leave no files or folders behind,
//! and the writing of whole files.

use std::fs;
use std::io;
use std::path::Path;

use crate::error::TwinError;
use twinrig_rig::error::Error;

/// Checks that files can be written to the folder `path`, which need not exist.
pub(super) fn check_folder(path: &Path) -> Result<(), TwinError> {
    let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
    let missing: Vec<&Path> = path.ancestors().take_while(missing).collect();
    let probe = path.join(format!(".twin-{}", std::process::id()));
    let written = fs::create_dir_all(path)
        .and_then(|()| fs::write(&probe, b"probe"))
        .and_then(|()| fs::remove_file(&probe));
    for folder in missing {
        // It may not exist, or contain files of another command.
        let _ = fs::remove_dir(folder);
    }
    written.map_err(|source| failed(path, source))
}

/// Checks that the file `path` can be written. Pipes and devices are not opened, because opening
/// may block and is visible to the process at the other end.
pub(super) fn check_file(path: &Path) -> Result<(), TwinError> {
    let before = fs::metadata(path);
    if before
        .as_ref()
        .is_ok_and(|found| !found.is_file() && !found.is_dir())
    {
        return Ok(());
    }
    let opened = fs::OpenOptions::new().create(true).append(true).open(path);
    opened.map_err(|source| failed(path, source))?;
    if before.is_err() {
        fs::remove_file(path).map_err(|source| failed(path, source))?;
    }
    Ok(())
}

/// Writes a file as a whole: one that exists stays as it was if that fails.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), TwinError> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".new");
    let new = path.with_file_name(name);
    let written = fs::write(&new, bytes).and_then(|()| fs::rename(&new, path));
    written.map_err(|source| {
        // It may not exist.
        let _ = fs::remove_file(&new);
        failed(path, source)
    })
}

/// Returns whether two paths are of one existing file or folder.
pub(super) fn is_same(a: &Path, b: &Path) -> bool {
    let [a, b] = [a, b].map(fs::canonicalize);
    a.is_ok_and(|a| b.is_ok_and(|b| a == b))
}

fn failed(path: &Path, source: io::Error) -> TwinError {
    let path = path.to_owned();
    TwinError::from(Error::Write { path, source })
}
