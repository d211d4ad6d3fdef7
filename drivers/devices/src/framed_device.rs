use std::error::Error;

use twinrig_kernel::SimDuration;
use twinrig_runtime::Wire;
use twinrig_wire::{
    Emulation, FaultSchedule, FramedDriver, FramedNode, Protocol, WireError, device_wire,
};

/// Configuration of a device at a serial port of its own, of which both sides of the wire are made.
pub trait FramedDevice: Sized + 'static {
    /// Invalid configuration.
    type Error: Error + From<WireError> + Send + Sync + 'static;
    /// Requests to the device and interpretation of its messages.
    type Protocol: Protocol + 'static;
    /// Device-specific part of the emulated device.
    type Emulation: Emulation + 'static;

    /// Time of a byte on the wire.
    const BYTE_TIME: SimDuration;

    /// Returns configurations for tests of all devices alike, one for each kind of board.
    fn examples() -> Vec<Self>;

    /// Creates the device-specific parts of the driver and of the emulated device.
    ///
    /// # Errors
    /// If the configuration is invalid.
    fn sides(&self) -> Result<(Self::Protocol, Self::Emulation), Self::Error>;

    /// Creates the driver, which runs on the robot.
    ///
    /// # Errors
    /// If the configuration is invalid.
    fn driver(&self) -> Result<FramedDriver<Self::Protocol>, Self::Error> {
        Ok(FramedDriver::new(self.sides()?.0))
    }

    /// Creates the emulated device.
    ///
    /// # Errors
    /// If the configuration is invalid.
    fn node(&self) -> Result<FramedNode<Self::Emulation>, Self::Error> {
        Ok(FramedNode::new(self.sides()?.1))
    }

    /// Creates the wire with the emulated device at its far end, and with the faults that are on
    /// `wire/NAME`.
    ///
    /// # Errors
    /// If the configuration or a fault is invalid.
    fn wire(&self, faults: &FaultSchedule) -> Result<impl Wire + use<Self> + 'static, Self::Error> {
        Ok(device_wire(Self::BYTE_TIME, faults, self.node()?)?)
    }
}
