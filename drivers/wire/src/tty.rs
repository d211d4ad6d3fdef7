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

/// Terminal device in non-blocking mode: common part of real ports and both ends of a PTY.
#[derive(Debug)]
pub(crate) struct Tty {
    pub(crate) place: String,
    file: File,
    /// Maximum wait for room in the device's buffer.
    write_limit: Duration,
}

/// Maximum size of one read \[bytes\]: a terminal's whole buffer.
const CHUNK: usize = 4096;

impl Tty {
    /// A terminal on `file`, which was opened in non-blocking mode.
    pub(crate) fn new(place: String, file: File, write_limit: Duration) -> Self {
        Self {
            place,
            file,
            write_limit,
        }
    }

    /// Opens a terminal without making it the controlling one (no Ctrl-C).
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
                    // A closed peer never makes room.
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
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        let mut chunk = [0; CHUNK];
        let mut waited = timeout.is_zero();
        let mut left = limit;
        while left > 0 {
            let requested = left.min(CHUNK);
            match self.file.read(&mut chunk[..requested]) {
                // The other end of the terminal is closed.
                Ok(0) => return Err(self.gone()),
                Ok(read) => {
                    bytes.extend_from_slice(&chunk[..read]);
                    left -= read;
                    if read < requested {
                        return Ok(());
                    }
                    waited = true;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if waited || self.wait(PollFlags::POLLIN, timeout)?.is_empty() {
                        return Ok(());
                    }
                    waited = true;
                }
                Err(error) => return Err(self.failed(&error)),
            }
        }
        Ok(())
    }

    /// Waits for `events`; returns the device's events, which may be a hang-up or an error, or none
    /// at the time-out.
    fn wait(&self, events: PollFlags, timeout: Duration) -> Result<PollFlags, DeviceError> {
        let mut poll_fds = [PollFd::new(self.file.as_fd(), events)];
        match ppoll(&mut poll_fds, Some(TimeSpec::from(timeout)), None) {
            Ok(0) | Err(Errno::EINTR) => Ok(PollFlags::empty()),
            Ok(_) => Ok(poll_fds[0].revents().unwrap_or(events)),
            Err(error) => Err(self.failed(&error.into())),
        }
    }

    fn gone(&self) -> DeviceError {
        DeviceError::Gone {
            place: self.place.clone(),
        }
    }

    /// Error of a device that was usable before.
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
