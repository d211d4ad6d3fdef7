use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use nix::errno::Errno;
use nix::fcntl::OFlag;
use twinrig_runtime::DeviceError;

use crate::byte_stream::ByteStream;

/// Terminal device: common part of real ports and both ends of a PTY.
pub(crate) type Tty = ByteStream<File>;

impl Tty {
    /// Opens a terminal without making it the controlling one (no Ctrl-C).
    pub(crate) fn open_file(path: &Path) -> Result<File, DeviceError> {
        let flags = OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
        let mut options = OpenOptions::new();
        options.read(true).write(true).custom_flags(flags.bits());
        let place = path.display().to_string();
        options.open(path).map_err(|error| refused(place, &error))
    }
}

/// Error of a device that could not be opened.
fn refused(place: String, error: &io::Error) -> DeviceError {
    match error.raw_os_error().map(Errno::from_raw) {
        Some(Errno::ENOENT | Errno::ENODEV | Errno::ENXIO | Errno::EIO) => {
            DeviceError::Missing { place }
        }
        Some(Errno::EACCES | Errno::EPERM) => DeviceError::Denied { place },
        Some(Errno::EBUSY) => DeviceError::Busy { place },
        _ => DeviceError::Other {
            place,
            why: error.to_string(),
        },
    }
}
