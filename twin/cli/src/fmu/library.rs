//! The library that an FMU contains.

use std::path::{Path, PathBuf};

use crate::fmu::error::ExportError;
use crate::fmu::resources::VERSION;
use crate::sweep::build_key::file_of_this_code;

/// Start of the marker that the library of FMUs contains: then come its version and
/// [`MARKER_END`]. The exporter composes the marker at run time, so that the program does not
/// contain it.
pub const MARKER_START: &str = "<twinrig-fmu ";
/// End of the marker.
pub const MARKER_END: &str = ">";

/// File name of the library beside the program.
const FILE: &str = "libtwinrig_fmu.so";

/// Reads the library in `file`, or where it is expected: in the folder of the program, or of the
/// Python package.
pub(crate) fn read(file: Option<&Path>) -> Result<Vec<u8>, ExportError> {
    let path = match file {
        Some(file) => file.to_owned(),
        None => beside_this_code()?,
    };
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(source) => return Err(ExportError::Unreadable { path, source }),
    };
    let marker = [MARKER_START, VERSION, MARKER_END].concat();
    let mut windows = bytes.windows(marker.len());
    if bytes.starts_with(b"\x7fELF") && windows.any(|window| window == marker.as_bytes()) {
        return Ok(bytes);
    }
    let version = VERSION;
    Err(ExportError::WrongLibrary { path, version })
}

/// Returns the path of the library in the folder of the file with this code.
fn beside_this_code() -> Result<PathBuf, ExportError> {
    let expected = file_of_this_code().map(|file| file.with_file_name(FILE));
    match expected {
        Some(path) if path.is_file() => Ok(path),
        expected => Err(ExportError::NoLibrary { expected }),
    }
}
