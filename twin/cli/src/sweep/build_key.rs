//! Hash of the program, which a row of a sweep depends on.

use std::fmt;
use std::fs::File;
use std::path::Path;

use crate::error::TwinError;

/// The running program under Linux, also if its file has been replaced since.
const RUNNING: &str = "/proc/self/exe";

/// Hash of a program: BLAKE3 of its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildKey([u8; 32]);

impl BuildKey {
    /// Returns the key of the running program.
    ///
    /// # Errors
    /// [`TwinError::Program`] if its file cannot be read.
    pub fn of_program() -> Result<Self, TwinError> {
        Self::of_file(Path::new(RUNNING))
    }

    /// Returns the key of the program, or of the library of a host program, in a file.
    ///
    /// # Errors
    /// [`TwinError::Program`] if it cannot be read.
    pub fn of_file(path: &Path) -> Result<Self, TwinError> {
        let mut hasher = blake3::Hasher::new();
        let read = File::open(path).and_then(|mut file| std::io::copy(&mut file, &mut hasher));
        match read {
            Ok(_) => Ok(Self(*hasher.finalize().as_bytes())),
            Err(source) => Err(TwinError::Program {
                path: path.to_owned(),
                source,
            }),
        }
    }

    /// Returns the key of a program with these bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Returns the 32 bytes.
    pub(crate) fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

/// 64 hexadecimal digits.
impl fmt::Display for BuildKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        blake3::Hash::from_bytes(self.0).to_hex().fmt(f)
    }
}
