//! Reading of files with a bound on their length.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Maximum length read from a pipe or device, which may be endless \[bytes\].
pub const STREAM_MOST: u64 = 16_000_000;

/// Maximum length of a text document \[bytes\]; longer ones are not hand-written.
pub const TEXT_MOST: u64 = 64_000_000;

/// Reads the file at `path`: a regular file of at most `most` bytes, any other up to
/// [`STREAM_MOST`].
///
/// # Errors
/// The file cannot be read or is longer; the length is checked before memory is allocated.
///
/// ```
/// use std::path::Path;
/// use twinrig_document::{TEXT_MOST, read_file};
///
/// assert!(read_file(Path::new("/no/such/file"), TEXT_MOST).is_err());
/// # #[cfg(target_os = "linux")] {
/// let endless = read_file(Path::new("/dev/zero"), TEXT_MOST).unwrap_err();
/// assert_eq!(endless.to_string(), "it is not a regular file and is longer than 16 MB");
/// # }
/// ```
pub fn read_file(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    let (most, why) = if metadata.is_file() {
        (most, format!("it is longer than {}", size(most)))
    } else {
        let most = STREAM_MOST;
        (
            most,
            format!("it is not a regular file and is longer than {}", size(most)),
        )
    };
    let too_long = || Error::new(ErrorKind::FileTooLarge, why.clone());
    let mut bytes = Vec::new();
    if metadata.is_file() {
        if metadata.len() > most {
            return Err(too_long());
        }
        let length = usize::try_from(metadata.len()).map_err(|_| too_long())?;
        let reserved = bytes.try_reserve_exact(length);
        reserved.map_err(|_| Error::from(ErrorKind::OutOfMemory))?;
    }
    // A file may grow while it is read.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(too_long());
    }
    Ok(bytes)
}

/// Formats a length: `16 MB`.
fn size(bytes: u64) -> String {
    format!("{} MB", bytes / 1_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_file_is_read_up_to_its_bound_only() {
        let path = std::env::temp_dir().join(format!("twinrig-read-{}", std::process::id()));
        std::fs::write(&path, b"12345").unwrap();
        assert_eq!(read_file(&path, 5).unwrap(), b"12345");
        let rejected = read_file(&path, 4).unwrap_err();
        assert_eq!(rejected.kind(), ErrorKind::FileTooLarge);
        // A sparse file is rejected without reading it.
        let file = File::options().write(true).open(&path).unwrap();
        file.set_len(TEXT_MOST + 1).unwrap();
        let rejected = read_file(&path, TEXT_MOST).unwrap_err();
        assert_eq!(rejected.to_string(), "it is longer than 64 MB");
        std::fs::remove_file(&path).unwrap();
    }
}
