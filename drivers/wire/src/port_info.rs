use std::path::PathBuf;
use std::time::Duration;

/// Serial port of this machine.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PortInfo {
    /// Path of the device.
    pub path: PathBuf,
    /// USB properties, if it is a USB device.
    pub usb: Option<UsbInfo>,
    /// Its latency timer, if it has one.
    pub latency_timer: Option<Duration>,
}

/// Descriptor of a USB device.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct UsbInfo {
    /// Vendor id: 0x0403 is FTDI.
    pub vendor: u16,
    /// Product id: 0x6010 is an FT2232H.
    pub product: u16,
    /// Names of manufacturer and product, as far as known.
    pub name: String,
    /// Serial number, as far as known.
    pub serial: Option<String>,
}
