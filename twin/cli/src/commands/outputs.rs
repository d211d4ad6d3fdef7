//! Whether what a command is to write can be written, found out before its work. What was not there before is gone afterwards:
//! a command that is refused leaves nothing behind.

use std::fs;
use std::io;
use std::path::Path;

use crate::error::TwinError;

/// A file in the folder `path`, which may have to be made.
pub(super) fn check_folder(path: &Path) -> Result<(), TwinError> {
    let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
    let missing: Vec<&Path> = path.ancestors().take_while(missing).collect();
    let probe = path.join(format!(".twin-{}", std::process::id()));
    let written = fs::create_dir_all(path)
        .and_then(|()| fs::write(&probe, b"probe"))
        .and_then(|()| fs::remove_file(&probe));
    for folder in missing {
        // It may not have come into being, and another command may have put something there.
        let _ = fs::remove_dir(folder);
    }
    written.map_err(|source| failed(path, source))
}

/// The file `path`. A pipe or a device is not tried: opening it may wait, and shows to whoever is at the other end.
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
    TwinError::Write { path, source }
}
