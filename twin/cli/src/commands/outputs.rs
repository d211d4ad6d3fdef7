//! Checks before a run that output files can be written. The checks leave no files or folders
//! behind.

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

fn failed(path: &Path, source: io::Error) -> TwinError {
    let path = path.to_owned();
    TwinError::from(Error::Write { path, source })
}
