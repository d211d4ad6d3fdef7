use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use twinrig_runtime::DeviceError;

/// Byte stream of the operating system in non-blocking mode: common part of real ports, both ends
/// of a PTY, and sockets.
#[derive(Debug)]
pub(crate) struct ByteStream<S> {
    pub(crate) place: String,
    pub(crate) stream: S,
    /// Maximum wait for room in the stream's buffer.
    write_limit: Duration,
}

/// Maximum size of one read \[bytes\]: a terminal's whole buffer.
const CHUNK: usize = 4096;

impl<S: Read + Write + AsFd> ByteStream<S> {
    /// A byte stream on `stream`, which is in non-blocking mode.
    pub(crate) fn new(place: String, stream: S, write_limit: Duration) -> Self {
        Self {
            place,
            stream,
            write_limit,
        }
    }

    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.write_front(&mut &*bytes)
    }

    /// Writes all of `rest`; after an error it has the bytes that are not written.
    pub(crate) fn write_front(&mut self, rest: &mut &[u8]) -> Result<(), DeviceError> {
        while !rest.is_empty() {
            match self.stream.write(rest) {
                Ok(0) => return Err(self.gone()),
                Ok(written) => *rest = &rest[written..],
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
            match self.stream.read(&mut chunk[..requested]) {
                // The other end is closed.
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

    /// Waits for `events`; returns the stream's events, which may be a hang-up or an error, or none
    /// at the time-out.
    pub(crate) fn wait(
        &self,
        events: PollFlags,
        timeout: Duration,
    ) -> Result<PollFlags, DeviceError> {
        let mut poll_fds = [PollFd::new(self.stream.as_fd(), events)];
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

    /// Error of a stream that was usable before.
    fn failed(&self, error: &io::Error) -> DeviceError {
        let place = self.place.clone();
        match error.raw_os_error().map(Errno::from_raw) {
            Some(
                Errno::EIO
                | Errno::ENODEV
                | Errno::ENXIO
                | Errno::EBADF
                | Errno::EPIPE
                | Errno::ECONNRESET
                | Errno::ECONNABORTED,
            ) => DeviceError::Gone { place },
            _ => DeviceError::Other {
                place,
                why: error.to_string(),
            },
        }
    }
}
