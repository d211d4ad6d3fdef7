use std::os::fd::BorrowedFd;
use std::time::Duration;

use thiserror::Error;

/// Most that [`Device::read`] takes at once \[bytes\]: a writer that does not pause keeps nobody reading for ever.
pub const READ_MAX: usize = 1 << 16;

/// A real byte transport, opened: a serial port, a PTY. Only the real-time executors touch one.
pub trait Device: Send {
    /// Where it is, for messages: `/dev/ttyUSB0`.
    fn place(&self) -> &str;

    /// Writes all of `bytes`, in one piece as far as the operating system lets it.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is gone or does not take them in time.
    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError>;

    /// Waits for bytes, for `patience` at most, and appends what has come to `bytes`, `limit` bytes at most; nothing is no
    /// error. What is beyond the limit stays in the device.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is gone.
    fn read_up_to(
        &mut self,
        limit: usize,
        patience: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError>;

    /// The same, as many as there are, up to [`READ_MAX`].
    ///
    /// # Errors
    /// [`DeviceError`] if the device is gone.
    fn read(&mut self, patience: Duration, bytes: &mut Vec<u8>) -> Result<(), DeviceError> {
        self.read_up_to(READ_MAX, patience, bytes)
    }

    /// What the operating system can wait for, beside other devices. One that has no such thing is looked at
    /// every millisecond where it is not the only one.
    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        None
    }
}

/// A device that cannot be used, and what can be done about it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DeviceError {
    /// There is none of that name.
    #[error("{place}: there is no such device; is it plugged in and switched on?")]
    Missing {
        /// Where it should be.
        place: String,
    },
    /// The user may not open it.
    #[error(
        "{place}: permission denied; serial ports belong to the group `dialout`: \
         `sudo usermod -aG dialout $USER`, then log in again"
    )]
    Denied {
        /// Where it is.
        place: String,
    },
    /// Somebody else has it open.
    #[error("{place}: in use; close the other program that has it open")]
    Busy {
        /// Where it is.
        place: String,
    },
    /// It was there, and is no more.
    #[error("{place}: the device is gone; was it unplugged, or lost its supply?")]
    Gone {
        /// Where it was.
        place: String,
    },
    /// The program at the other end of a PTY has closed it. It may open it again.
    #[error("{place}: the program at the other end has closed it")]
    HungUp {
        /// Where it is.
        place: String,
    },
    /// It does not take what is written.
    #[error("{place}: took no more bytes for {limit:?}; is anybody reading at the other end?")]
    Stuck {
        /// Where it is.
        place: String,
        /// How long it was waited for.
        limit: Duration,
    },
    /// Something else.
    #[error("{place}: {why}")]
    Other {
        /// Where it is.
        place: String,
        /// What.
        why: String,
    },
}
