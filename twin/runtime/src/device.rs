use std::time::Duration;

use thiserror::Error;

/// A real byte transport, opened: a serial port, a PTY. Only the real-time executor touches one.
pub trait Device: Send {
    /// Where it is, for messages: `/dev/ttyUSB0`.
    fn place(&self) -> &str;

    /// Writes all of `bytes`, in one piece as far as the operating system lets it.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is gone or does not take them in time.
    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError>;

    /// Waits for bytes, for `patience` at most, and appends what has come to `bytes`; nothing is no error.
    ///
    /// # Errors
    /// [`DeviceError`] if the device is gone.
    fn read(&mut self, patience: Duration, bytes: &mut Vec<u8>) -> Result<(), DeviceError>;
}

/// A device that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{place}: {why}")]
pub struct DeviceError {
    /// Where it is, or was.
    pub place: String,
    /// What is the matter, with what can be done about it.
    pub why: String,
}
