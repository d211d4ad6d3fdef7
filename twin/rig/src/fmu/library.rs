//! The library that an FMU contains.

use std::path::{Path, PathBuf};

use crate::build_key::file_of_this_code;
use crate::fmu::error::ExportError;
use crate::fmu::resources::VERSION;

/// Marker of the library of FMUs with its version. The library contains the bytes in reverse order,
/// the program in this one, so that the program is not taken for the library.
pub const MARKER: &str = concat!("|twinrig-fmu ", env!("CARGO_PKG_VERSION"), "|");

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
    let marker: Vec<u8> = MARKER.bytes().rev().collect();
    let mut windows = bytes.windows(marker.len());
    if bytes.starts_with(b"\x7fELF") && windows.any(|window| window == marker) {
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
