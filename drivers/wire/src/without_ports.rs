//! In place of ports and PTYs where there is no Linux: none can be opened.

use std::convert::Infallible;
use std::path::Path;
use std::time::Duration;

use twinrig_runtime::{Device, DeviceError};

use crate::network_address::NetworkAddress;
use crate::port_info::PortInfo;

/// Real serial port, which this system does not have.
#[derive(Debug)]
pub struct SerialPort(Infallible);

impl SerialPort {
    /// Refuses to open a port.
    ///
    /// # Errors
    /// [`DeviceError::NeedsLinux`].
    pub fn open(path: &Path, _baud_rate: u32) -> Result<Self, DeviceError> {
        let place = path.display().to_string();
        Err(DeviceError::NeedsLinux { place })
    }

    /// Returns the latency timer of the chip behind this port.
    pub fn latency_timer(&self) -> Option<Duration> {
        match self.0 {}
    }

    /// Returns a warning for the user before a run.
    pub fn advice(&self) -> Option<String> {
        match self.0 {}
    }
}

/// Master end of a pseudo-terminal, which this system does not have.
#[derive(Debug)]
pub struct Pty(Infallible);

impl Pty {
    /// Refuses to open a pseudo-terminal.
    ///
    /// # Errors
    /// [`DeviceError::NeedsLinux`].
    pub fn open() -> Result<Self, DeviceError> {
        let place = "a new PTY".to_owned();
        Err(DeviceError::NeedsLinux { place })
    }

    /// Makes the slave end available under a fixed name.
    ///
    /// # Errors
    /// None: there is no such value.
    pub fn linked(self, _link: &Path) -> Result<Self, DeviceError> {
        match self.0 {}
    }

    /// Path of the slave end.
    pub fn path(&self) -> &Path {
        match self.0 {}
    }
}

/// Serial port of another machine, for which this system has no real time.
#[derive(Debug)]
pub struct RemotePort(Infallible);

impl RemotePort {
    /// Refuses to open a port.
    ///
    /// # Errors
    /// [`DeviceError::NeedsLinux`].
    pub fn open(address: &NetworkAddress, _baud_rate: u32) -> Result<Self, DeviceError> {
        let place = address.to_string();
        Err(DeviceError::NeedsLinux { place })
    }
}

/// Port served over a network, for which this system has no real time.
#[derive(Debug)]
pub struct PortServer(Infallible);

impl PortServer {
    /// Refuses to serve a port.
    ///
    /// # Errors
    /// [`DeviceError::NeedsLinux`].
    pub fn listen(address: &NetworkAddress, _baud_rate: u32) -> Result<Self, DeviceError> {
        let place = address.to_string();
        Err(DeviceError::NeedsLinux { place })
    }

    /// Address by which clients on this machine connect.
    pub fn address(&self) -> &NetworkAddress {
        match self.0 {}
    }
}

/// Devices that cannot exist.
macro_rules! no_device {
    ($($name:ty),*) => {$(
        impl Device for $name {
            fn place(&self) -> &str {
                match self.0 {}
            }

            fn write(&mut self, _bytes: &[u8]) -> Result<(), DeviceError> {
                match self.0 {}
            }

            fn read_up_to(
                &mut self,
                _limit: usize,
                _timeout: Duration,
                _bytes: &mut Vec<u8>,
            ) -> Result<(), DeviceError> {
                match self.0 {}
            }
        }
    )*};
}

no_device!(SerialPort, Pty, RemotePort, PortServer);

/// Refuses to list ports.
///
/// # Errors
/// [`DeviceError::NeedsLinux`].
pub fn ports() -> Result<Vec<PortInfo>, DeviceError> {
    let place = "the list of ports".to_owned();
    Err(DeviceError::NeedsLinux { place })
}
