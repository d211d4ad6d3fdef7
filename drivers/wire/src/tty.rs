use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

use nix::errno::Errno;
use nix::fcntl::OFlag;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use twinrig_runtime::DeviceError;

/// A terminal device that is opened and never blocks: what real ports and both ends of a PTY have in common.
#[derive(Debug)]
pub(crate) struct Tty {
    pub(crate) place: String,
    file: File,
    /// How long a full device is waited for.
    write_limit: Duration,
}

/// What is read at once \[bytes\]: a terminal's whole buffer.
const CHUNK: usize = 4096;

impl Tty {
    /// What `file` is, opened without blocking.
    pub(crate) fn new(place: String, file: File, write_limit: Duration) -> Self {
        Self {
            place,
            file,
            write_limit,
        }
    }

    /// Opens a terminal for bytes, not as the one that Ctrl-C is typed at.
    pub(crate) fn open_file(path: &Path) -> Result<File, DeviceError> {
        let flags = OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
        let mut options = OpenOptions::new();
        options.read(true).write(true).custom_flags(flags.bits());
        let place = path.display().to_string();
        options.open(path).map_err(|error| refused(place, &error))
    }

    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        let mut rest = bytes;
        while !rest.is_empty() {
            match self.file.write(rest) {
                Ok(0) => return Err(self.gone()),
                Ok(written) => rest = &rest[written..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    let ready = self.wait(PollFlags::POLLOUT, self.write_limit)?;
                    // Whoever does not read any more because they are gone makes no room, ever.
                    if ready.intersects(PollFlags::POLLHUP | PollFlags::POLLERR) {
                        return Err(self.gone());
                    }
                    if ready.is_empty() {
                        return Err(DeviceError::Stuck {
                            place: self.place.clone(),
                            limit: self.write_limit,
                        });
                    }
                }
                Err(error) => return Err(self.failed(&error)),
            }
        }
        Ok(())
    }

    pub(crate) fn read_up_to(
        &mut self,
        limit: usize,
        patience: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        let mut chunk = [0; CHUNK];
        let mut waited = patience.is_zero();
        let mut left = limit;
        while left > 0 {
            let wanted = left.min(CHUNK);
            match self.file.read(&mut chunk[..wanted]) {
                // A terminal whose other end is gone for good.
                Ok(0) => return Err(self.gone()),
                Ok(read) => {
                    bytes.extend_from_slice(&chunk[..read]);
                    left -= read;
                    if read < wanted {
                        return Ok(());
                    }
                    waited = true;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if waited || self.wait(PollFlags::POLLIN, patience)?.is_empty() {
                        return Ok(());
                    }
                    waited = true;
                }
                Err(error) => return Err(self.failed(&error)),
            }
        }
        Ok(())
    }

    /// Waits for `what`; says what the device has, be it that it is gone: nothing if the time is over.
    fn wait(&self, what: PollFlags, patience: Duration) -> Result<PollFlags, DeviceError> {
        let mut watched = [PollFd::new(self.file.as_fd(), what)];
        match ppoll(&mut watched, Some(TimeSpec::from(patience)), None) {
            Ok(0) | Err(Errno::EINTR) => Ok(PollFlags::empty()),
            Ok(_) => Ok(watched[0].revents().unwrap_or(what)),
            Err(error) => Err(self.failed(&error.into())),
        }
    }

    fn gone(&self) -> DeviceError {
        DeviceError::Gone {
            place: self.place.clone(),
        }
    }

    /// A device that could be used until now.
    fn failed(&self, error: &io::Error) -> DeviceError {
        let place = self.place.clone();
        match error.raw_os_error().map(Errno::from_raw) {
            Some(Errno::EIO | Errno::ENODEV | Errno::ENXIO | Errno::EBADF | Errno::EPIPE) => {
                DeviceError::Gone { place }
            }
            _ => DeviceError::Other {
                place,
                why: error.to_string(),
            },
        }
    }
}

/// A device that could not be opened.
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
