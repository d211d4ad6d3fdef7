//! Files that are in the way.

use std::io::{self, ErrorKind};
use std::path::Path;

use twinrig_rig::error::Error;

use crate::error::TwinError;

/// Returns the error of a file that cannot be created, perhaps because it exists.
pub(super) fn not_written(path: &Path, source: io::Error) -> TwinError {
    let path = path.to_owned();
    TwinError::from(match source.kind() {
        ErrorKind::AlreadyExists => Error::InvalidOptions {
            why: format!("{} exists", path.display()),
            help: "nothing is overwritten: choose another file with --out".to_owned(),
        },
        _ => Error::Write { path, source },
    })
}
