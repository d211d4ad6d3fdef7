//! Byte transports with their timing: what stands between a driver and the boards that it talks to, in
//! virtual time and, with the same driver, on a real port. In virtual time the same bytes at the same times, seed and faults give
//! the same bytes at the same times, bit for bit, however closely one looks; nothing is woken byte by
//! byte; a transport can be saved amid a byte; and what runs allocates nothing.
//!
//! Transports nest. From the host outwards: [`UsbSerial`] or [`HostEnd`] is the `Wire` that a driver talks over; [`Uart`],
//! [`Faulty`] and [`Traced`] are each a [`Line`] around a line; [`Rs485`] (several [`Node`]s, half duplex) and [`Duplex`] (one)
//! are the far end; [`FaultyNode`] is a node around a node.
//!
//! A device on a line of its own that is spoken to in frames takes two small parts: a [`Protocol`], of which [`FramedDriver`]
//! makes a driver, and an [`Emulation`], of which [`FramedNode`] makes a node.
//!
//! ```
//! use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
//! use twinrig_runtime::{PlantFault, PlantSignals, TaskError, Wire, WiringError, World};
//! use twinrig_wire::{Node, Piece, Rs485, UsbSerial, UsbTiming};
//!
//! /// Says back what it hears, 10 µs later.
//! #[derive(Default)]
//! struct Echo(Vec<u8>, Option<SimTime>);
//! impl Node for Echo {
//!     fn name(&self) -> &str { "echo" }
//!     fn connect(&mut self, _: &str, _: &PlantSignals) -> Result<(), WiringError> { Ok(()) }
//!     fn hear(&mut self, piece: Piece<'_>) {
//!         self.0.extend_from_slice(piece.bytes);
//!         self.1 = Some(piece.last() + SimDuration::from_micros(10));
//!     }
//!     fn next_wake(&self) -> Option<SimTime> { None }
//!     fn advance(&mut self, _: SimTime, _: &mut dyn World) -> Result<(), TaskError> { Ok(()) }
//!     fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
//!         bytes.append(&mut self.0);
//!         self.1.take()
//!     }
//!     fn save(&self) -> Snapshot { Snapshot::of(&(&self.0, self.1)) }
//!     fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
//!         (self.0, self.1) = snapshot.read()?;
//!         Ok(())
//!     }
//! }
//!
//! /// There is no plant.
//! struct Nowhere;
//! impl World for Nowhere {
//!     fn sample(&mut self, _: std::ops::Range<usize>) -> Result<&[f64], PlantFault> { Ok(&[]) }
//!     fn actuate(&mut self, _: std::ops::Range<usize>) -> Result<&mut [f64], PlantFault> { Ok(&mut []) }
//! }
//!
//! let (byte_time, turnaround) = (SimDuration::from_micros(3), SimDuration::from_micros(2));
//! let bus = Rs485::new("demo", byte_time, turnaround, vec![Box::new(Echo::default())])?;
//! let mut wire = UsbSerial::new("demo", UsbTiming::default(), byte_time, 1, bus)?;
//!
//! wire.send(SimTime::ZERO, b"anybody there?");
//! let (mut now, mut read) = (SimTime::ZERO, Vec::new());
//! while let Some(wake) = wire.next_wake() {
//!     now = wake;
//!     wire.advance(now, &mut Nowhere)?;
//!     wire.receive(&mut read);
//! }
//! assert_eq!(read, b"anybody there?");
//! // 94 µs on the bus cost five microframes, and 20 µs until the host's program runs.
//! assert_eq!(now, SimTime::ZERO + SimDuration::from_micros(645));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do: it knows no protocol, and no packets but those of USB; no baud rates that differ between the ends of a wire,
//! no parity, no flow control and no modem lines; no limit of the converter's receive buffer, and of its transmit buffer only for
//! who asks for the room in it; no levels on the wires but high and low; no byte that a wrong bit makes a receiver see where none was sent; and it reads no scenario.

mod analog_source;
mod arrivals;
mod distortion;
mod duplex;
mod error;
mod fault;
mod faulty;
mod faulty_node;
mod framed_driver;
mod framed_node;
mod framer;
mod host_end;
mod line;
mod medium;
mod microframes;
mod node;
mod noise;
mod port;
mod pty;
mod rs485;
mod traced;
mod tty;
mod uart;
mod usb_serial;
mod usb_timing;

pub use analog_source::AnalogSource;
pub use arrivals::{Arrivals, Piece};
pub use duplex::Duplex;
pub use error::WireError;
pub use fault::{Fault, FaultSchedule};
pub use faulty::Faulty;
pub use faulty_node::FaultyNode;
pub use framed_driver::{FrameOutcome, FramedDriver, Protocol, RequestKind};
pub use framed_node::{Emulation, FramedNode, TxQueue};
pub use framer::{FrameMatch, Framer, FramerState, crc16};
pub use host_end::HostEnd;
pub use line::{Line, earlier};
pub use node::Node;
pub use port::{PortInfo, SerialPort, UsbInfo, ports};
pub use pty::Pty;
pub use rs485::Rs485;
pub use traced::Traced;
pub use twinrig_runtime::FaultKind;
pub use uart::Uart;
pub use usb_serial::UsbSerial;
pub use usb_timing::{CompletionRule, InRule, OutRule, TURNAROUND, UsbPreset, UsbTiming};
