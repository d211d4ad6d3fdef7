#[cfg(target_os = "linux")]
use std::os::fd::BorrowedFd;
use std::time::Duration;

use thiserror::Error;

/// Maximum number of bytes per [`Device::read`] \[bytes\], so that a writer without pauses cannot
/// block the reader indefinitely.
pub const READ_MAX: usize = 1 << 16;

/// An open byte transport of the machine: a serial port, a PTY, a connection over a network. Used
/// by the real-time executors only.
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
    /// The program at the other end of a PTY, or of a served connection, has closed it. It may be
    /// opened again.
    #[error("{place}: the program at the other end has closed it")]
    HungUp {
        /// Location of the device.
        place: String,
    },
    /// The server of a port over a network has ended the connection.
    #[error(
        "{place}: the server has closed the connection; does it serve another client, or has it \
         ended?"
    )]
    Closed {
        /// Address of the server.
        place: String,
    },
    /// An address of a network is malformed.
    #[error("{place}: {why}; an address is tcp://HOST:PORT or rfc2217://HOST:PORT")]
    BadAddress {
        /// The address.
        place: String,
        /// The mistake.
        why: String,
    },
    /// The name of a host has no address.
    #[error("{place}: there is no such host ({why}); is the name right, and the network up?")]
    NoHost {
        /// Address of the server.
        place: String,
        /// Error of the operating system.
        why: String,
    },
    /// No program listens at an address of a network.
    #[error(
        "{place}: the connection was refused; does a server listen at this port? `twin serve \
         --listen` is one"
    )]
    ConnectionRefused {
        /// Address of the server.
        place: String,
    },
    /// A host does not answer.
    #[error(
        "{place}: no connection within {limit:?}; is the host switched on, and does a firewall \
         block the port?"
    )]
    NoConnection {
        /// Address of the server.
        place: String,
        /// Time waited.
        limit: Duration,
    },
    /// A server does not answer to the negotiation of RFC 2217.
    #[error(
        "{place}: no answer within {limit:?} about {missing}; is it a server by RFC 2217? \
         One of raw bytes is tcp://"
    )]
    NoAnswer {
        /// Address of the server.
        place: String,
        /// Time waited.
        limit: Duration,
        /// Request without an answer.
        missing: String,
    },
    /// A server by RFC 2217 cannot set the port as requested.
    #[error("{place}: the server refuses the settings: {why}; use one that can set this port")]
    Refused {
        /// Address of the server.
        place: String,
        /// The refused setting.
        why: String,
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
