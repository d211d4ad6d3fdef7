//! Hash of the program, which a row of a sweep depends on.

use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};

use crate::error::Error;

/// The running program under Linux, also if its file has been replaced since.
const RUNNING: &str = "/proc/self/exe";
/// Mapped files of the process.
const MAPPED: &str = "/proc/self/maps";

/// Hash of a program: BLAKE3 of its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildKey([u8; 32]);

impl BuildKey {
    /// Returns the key of the running program, or of the library with this code where another
    /// program has loaded it, such as an interpreter.
    ///
    /// # Errors
    /// [`Error::Program`] if its file cannot be read.
    pub fn of_program() -> Result<Self, Error> {
        let program = std::fs::read_link(RUNNING).ok();
        match file_of_this_code() {
            Some(library) if program.is_some_and(|program| program != library) => {
                Self::of_file(&library)
            }
            _ => Self::of_file(Path::new(RUNNING)),
        }
    }

    /// Returns the key of the program, or of the library of a host program, in a file.
    ///
    /// # Errors
    /// [`Error::Program`] if it cannot be read.
    pub fn of_file(path: &Path) -> Result<Self, Error> {
        let mut hasher = blake3::Hasher::new();
        let read = File::open(path).and_then(|mut file| std::io::copy(&mut file, &mut hasher));
        match read {
            Ok(_) => Ok(Self(*hasher.finalize().as_bytes())),
            Err(source) => Err(Error::Program {
                path: path.to_owned(),
                source,
            }),
        }
    }

    /// Returns the key of a program with these bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Returns the key of these 32 bytes; none for another number of them.
    pub fn of_key(bytes: &[u8]) -> Option<Self> {
        bytes.try_into().ok().map(Self)
    }

    /// Returns the 32 bytes.
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

/// 64 hexadecimal digits.
impl fmt::Display for BuildKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        blake3::Hash::from_bytes(self.0).to_hex().fmt(f)
    }
}

/// Returns the file that the code of this crate was loaded from.
pub fn file_of_this_code() -> Option<PathBuf> {
    let address = file_of_this_code as *const () as usize;
    let maps = std::fs::read_to_string(MAPPED).ok()?;
    let path = maps.lines().find_map(|line| mapped_at(line, address))?;
    Some(PathBuf::from(path))
}

/// Returns the file of a line of the list of mappings, if it contains `address`:
/// `7f0c1000-7f0c9000 r-xp 00001000 fd:00 1234  /usr/lib/libc.so.6`.
fn mapped_at(line: &str, address: usize) -> Option<&str> {
    let (start, rest) = line.split_once('-')?;
    let (end, rest) = rest.split_once(' ')?;
    let bound = |text| usize::from_str_radix(text, 16).ok();
    let path = &rest[rest.find('/')?..];
    (bound(start)?..bound(end)?)
        .contains(&address)
        .then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_of_the_code_is_found_among_the_mappings() {
        let line = "7f0c1000-7f0c9000 r-xp 00001000 fd:00 1234      /opt/my lib/libtwin.so";
        assert_eq!(mapped_at(line, 0x7f0c_1000), Some("/opt/my lib/libtwin.so"));
        assert_eq!(mapped_at(line, 0x7f0c_9000), None);
        assert_eq!(
            mapped_at("7f0c1000-7f0c9000 rw-p 00000000 00:00 0 ", 0x7f0c_1000),
            None
        );
        // A test is a program of its own.
        assert_eq!(file_of_this_code(), std::fs::read_link(RUNNING).ok());
    }
}
