#[cfg(target_os = "linux")]
use std::os::fd::BorrowedFd;
use std::time::Duration;

use thiserror::Error;

/// Maximum number of bytes per [`Device::read`] \[bytes\], so that a writer without pauses cannot
/// block the reader indefinitely.
pub const READ_MAX: usize = 1 << 16;

/// An open byte transport of the machine: a serial port, a PTY. Used by the real-time executors
/// only.
pub trait Device: Send {
    /// Returns the location, used in messages: `/dev/ttyUSB0`.
    fn place(&self) -> &str;

    /// Writes all of `bytes`, in one piece as far as the operating system permits.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is lost or does not accept the bytes in time.
    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError>;

    /// Waits for bytes for at most `timeout`, and appends at most `limit` bytes to `bytes`; none is
    /// no error. Bytes beyond the limit remain in the device.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is lost.
    fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError>;

    /// Waits for bytes as [`Device::read_up_to`] does, up to [`READ_MAX`] of them.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is lost.
    fn read(&mut self, timeout: Duration, bytes: &mut Vec<u8>) -> Result<(), DeviceError> {
        self.read_up_to(READ_MAX, timeout, bytes)
    }

    /// Returns a descriptor that the operating system can poll. Without one, the device is polled
    /// every millisecond unless it is the only one.
    #[cfg(target_os = "linux")]
    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        None
    }
}

/// Failure of a device, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DeviceError {
    /// There is no device of that name.
    #[error("{place}: there is no such device; is it plugged in and switched on?")]
    Missing {
        /// Location of the device.
        place: String,
    },
    /// The user has no permission to open it.
    #[error(
        "{place}: permission denied; serial ports belong to the group `dialout`: \
         `sudo usermod -aG dialout $USER`, then log in again"
    )]
    Denied {
        /// Location of the device.
        place: String,
    },
    /// Another program has it open.
    #[error("{place}: in use; close the other program that has it open")]
    Busy {
        /// Location of the device.
        place: String,
    },
    /// The device has disappeared.
    #[error("{place}: the device is gone; was it unplugged, or lost its supply?")]
    Gone {
        /// Location of the device.
        place: String,
    },
    /// The program at the other end of a PTY has closed it. It may be opened again.
    #[error("{place}: the program at the other end has closed it")]
    HungUp {
        /// Location of the device.
        place: String,
    },
    /// The device accepts no more bytes.
    #[error("{place}: took no more bytes for {limit:?}; is the other end being read?")]
    Stuck {
        /// Location of the device.
        place: String,
        /// Time waited.
        limit: Duration,
    },
    /// This system has neither real time nor ports.
    #[error(
        "{place}: serial ports and real time need Linux; without `--port` the scenario runs here, \
         in virtual time"
    )]
    NeedsLinux {
        /// Location of the device.
        place: String,
    },
    /// Another error of the operating system.
    #[error("{place}: {why}")]
    Other {
        /// Location of the device.
        place: String,
        /// The error.
        why: String,
    },
}
