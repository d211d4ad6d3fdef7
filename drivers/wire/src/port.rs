use std::fs;
use std::os::fd::BorrowedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{
    ClearBuffer, DataBits, FlowControl, Parity, SerialPort as _, SerialPortType, StopBits, TTYPort,
};
use twinrig_runtime::{Device, DeviceError};

use crate::port_info::{PortInfo, UsbInfo};
use crate::tty::Tty;

/// Real serial port, or the slave end of a PTY, opened exclusively: 8 data bits, no parity, one
/// stop bit, no flow control.
pub struct SerialPort {
    tty: Tty,
    path: PathBuf,
    /// Keeps the settings and the exclusive lock.
    _settings: TTYPort,
}

/// Maximum wait for room in the transmit buffer: 4096 bytes at 1 Mbit/s take 41 ms.
const WRITE_LIMIT: Duration = Duration::from_millis(100);

impl SerialPort {
    /// Opens the port at `path` with `baud_rate` \[bit/s\], any rate that its chip supports. Bytes
    /// received before are discarded.
    ///
    /// # Errors
    /// [`DeviceError`] with the cause and a remedy.
    pub fn open(path: &Path, baud_rate: u32) -> Result<Self, DeviceError> {
        let place = path.display().to_string();
        let file = Tty::open_file(path)?;
        let settings = serialport::new(place.clone(), baud_rate)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .exclusive(true)
            .open_native()
            .and_then(|port| port.clear(ClearBuffer::Input).map(|()| port));
        let settings = settings.map_err(|error| refused(&place, baud_rate, &error))?;
        Ok(Self {
            tty: Tty::new(place, file, WRITE_LIMIT),
            path: path.into(),
            _settings: settings,
        })
    }

    /// Returns the latency timer of the FTDI chip behind this port: the maximum time for which it
    /// holds bytes that do not fill a packet. None if there is no such chip.
    pub fn latency_timer(&self) -> Option<Duration> {
        latency_timer(&self.path)
    }

    /// Returns a warning for the user before a run, with a remedy: a latency timer longer than 1
    /// ms.
    pub fn advice(&self) -> Option<String> {
        let timer = self.latency_timer().filter(|timer| *timer > LOW_LATENCY)?;
        let file = latency_file(&self.path)?;
        Some(format!(
            "{}: the latency timer of {timer:?} delays short answers by that time; \
             `echo 1 | sudo tee {}` sets it to 1 ms",
            self.tty.place,
            file.display()
        ))
    }
}

const LOW_LATENCY: Duration = Duration::from_millis(1);

/// Path of the port's latency timer in Linux's sysfs, if its driver has one.
fn latency_file(path: &Path) -> Option<PathBuf> {
    // Resolves links such as /dev/serial/by-id.
    let device = fs::canonicalize(path).ok()?;
    let name = device.file_name()?;
    let file = Path::new("/sys/class/tty")
        .join(name)
        .join("device/latency_timer");
    file.exists().then_some(file)
}

fn latency_timer(path: &Path) -> Option<Duration> {
    let text = fs::read_to_string(latency_file(path)?).ok()?;
    text.trim().parse().ok().map(Duration::from_millis)
}

fn refused(place: &str, baud_rate: u32, error: &serialport::Error) -> DeviceError {
    let place = place.into();
    match error.kind() {
        serialport::ErrorKind::NoDevice => DeviceError::Busy { place },
        serialport::ErrorKind::Io(std::io::ErrorKind::PermissionDenied) => {
            DeviceError::Denied { place }
        }
        _ if error.description.contains("exclusive lock") => DeviceError::Busy { place },
        _ => DeviceError::Other {
            place,
            why: format!("cannot be set to {baud_rate} bit/s, 8N1: {error}"),
        },
    }
}

impl Device for SerialPort {
    fn place(&self) -> &str {
        &self.tty.place
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
        self.tty.write(bytes)
    }

    fn read_up_to(
        &mut self,
        limit: usize,
        timeout: Duration,
        bytes: &mut Vec<u8>,
    ) -> Result<(), DeviceError> {
        self.tty.read_up_to(limit, timeout, bytes)
    }

    fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        Some(self.tty.descriptor())
    }
}

/// Returns the serial ports of this machine, sorted by path.
///
/// # Errors
/// [`DeviceError::Other`] if the system does not list them.
pub fn ports() -> Result<Vec<PortInfo>, DeviceError> {
    const SOURCE: &str = "/sys/class/tty";
    if !Path::new(SOURCE).is_dir() {
        return Ok(Vec::new());
    }
    let found = serialport::available_ports().map_err(|error| DeviceError::Other {
        place: SOURCE.into(),
        why: error.to_string(),
    })?;
    let mut ports: Vec<PortInfo> = found.into_iter().map(info).collect();
    ports.sort();
    Ok(ports)
}

fn info(port: serialport::SerialPortInfo) -> PortInfo {
    let path = PathBuf::from(port.port_name);
    let usb = match port.port_type {
        SerialPortType::UsbPort(usb) => {
            let names = [usb.manufacturer, usb.product];
            let names: Vec<String> = names.into_iter().flatten().collect();
            Some(UsbInfo {
                vendor: usb.vid,
                product: usb.pid,
                name: names.join(" "),
                serial: usb.serial_number,
            })
        }
        _ => None,
    };
    PortInfo {
        latency_timer: latency_timer(&path),
        path,
        usb,
    }
}
