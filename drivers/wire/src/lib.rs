//! Byte transports with their timing.

mod arrivals;
mod duplex;
mod error;
mod fault;
mod faulty;
mod faulty_node;
mod frames;
mod framer;
mod host_end;
mod line;
mod medium;
mod node;
mod rs485;
mod tap;
mod traced;
mod uart;
mod usb_serial;
mod usb_timing;

pub use arrivals::{Arrivals, Piece};
pub use duplex::Duplex;
pub use error::WireError;
pub use fault::{Fault, FaultKind, FaultSchedule};
pub use faulty::Faulty;
pub use faulty_node::FaultyNode;
pub use framer::{Framer, FramerState, Measure, crc16};
pub use host_end::HostEnd;
pub use line::Line;
pub use node::Node;
pub use rs485::Rs485;
pub use tap::Tap;
pub use traced::Traced;
pub use uart::Uart;
pub use usb_serial::UsbSerial;
pub use usb_timing::{CompletionRule, InRule, OutRule, TURNAROUND, UsbPreset, UsbTiming};
