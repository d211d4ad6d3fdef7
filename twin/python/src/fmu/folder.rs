//! Temporary folders of workers.

use std::fs::{self, DirBuilder};
use std::io::{self, ErrorKind};
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::fork::Generation;

/// Number of names that are tried.
const NAMES_MAX: u32 = 10_000;

/// Number in the next name. No name returns: an FMU in Python leaves its folder in the paths of the
/// interpreter, which keeps the contents of folders by their names.
static NEXT: AtomicU32 = AtomicU32::new(0);

/// A folder for one worker: the archive, its extracted files, and files that the FMU writes into
/// the current folder. It is removed on drop.
pub(super) struct Folder {
    path: PathBuf,
    generation: Generation,
}

impl Folder {
    /// Creates a folder that other users cannot read.
    pub fn create() -> io::Result<Self> {
        let base = std::env::temp_dir();
        let process = std::process::id();
        for _ in 0..NAMES_MAX {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let path = base.join(format!("twinrig-fmu-{process}-{number}"));
            match DirBuilder::new().mode(0o700).create(&path) {
                Ok(()) => {
                    let generation = Generation::current();
                    return Ok(Self { path, generation });
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if !self.generation.is_past() {
            // A file that cannot be removed stays in the folder for temporary files.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}
