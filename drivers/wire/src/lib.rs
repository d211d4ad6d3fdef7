//! Byte transports with their timing between a driver and the boards: in virtual time and, with the
//! same driver, on a real port, also over a network. Properties in virtual time:
//!
//! - Deterministic: equal bytes, times, seed and faults give equal bytes at equal times, bit for
//!   bit, independently of the instants at which a transport is advanced.
//! - No wake-up per byte.
//! - A transport can be saved within a byte.
//! - A running transport does not allocate.
//!
//! Transports nest. From the host outwards: [`UsbSerial`] or [`HostEnd`] is the `Wire` of a driver;
//! [`Uart`], [`Faulty`] and [`Traced`] are each a [`Line`] around a line; [`Rs485`] (several
//! [`Node`]s, half duplex) and [`Duplex`] (one) are the far end; [`FaultyNode`] is a node around a
//! node.
//!
//! *Pull, and no event per byte.* A [`Line`] is advanced to an instant and then has the bytes
//! complete by then ([`Arrivals`], with their times). Bytes that cannot change any more are
//! announced when they begin; on a bus, where a collision may still occur, they are delivered as
//! they arrive. `next_wake` returns only the instants at which something can become visible: about
//! thirty in a cycle of four boards, instead of hundreds of bytes. Advancing more often changes
//! nothing (a property test).
//!
//! *Packets as a whole.* A packet reaches the nodes that listen to its address only
//! ([`Node::listens_to`]). Where each node listens to one address, an undisturbed answer is passed
//! to the near end with the times of its bytes before it begins ([`Line::take_packet`]), and what
//! happens between two visible events takes no call from outside ([`Line::run_ahead`]): sixteen
//! instants in a cycle of four boards, eight of them ticks. All else is computed byte by byte. That
//! is the reference of property tests over random buses, bytes and instants
//! (`drivers/motordriver/src/tests/bus/packets.rs`, `drivers/feetech/tests/feetech/packets.rs`):
//! the results are the same bit for bit.
//!
//! A device with a framed protocol on a separate line takes three small parts: the messages
//! ([`FramedMessage`]), a [`Protocol`], which [`FramedDriver`] turns into a driver, and an
//! [`Emulation`], which [`FramedNode`] turns into a node; [`device_wire`] is its wire.
//! [`FrameFormat`], [`Fields`], [`SequenceNumber`], [`AnalogInputs`] and [`quantize`] are for use
//! in these parts.
//!
//! ```
//! use twinrig_kernel::{SimDuration, SimTime, Snapshot, SnapshotError};
//! use twinrig_runtime::{Part, PlantAccess, PlantFault, TaskError, Wire};
//! use twinrig_wire::{Node, Piece, Rs485, UsbSerial, UsbTiming};
//!
//! /// Transmits the received bytes again, 10 µs later.
//! #[derive(Default)]
//! struct Echo(Vec<u8>, Option<SimTime>);
//! impl Node for Echo {
//!     fn name(&self) -> &str { "echo" }
//!     fn receive(&mut self, piece: Piece<'_>) {
//!         self.0.extend_from_slice(piece.bytes);
//!         self.1 = Some(piece.last() + SimDuration::from_micros(10));
//!     }
//!     fn next_wake(&self) -> Option<SimTime> { None }
//!     fn advance(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<(), TaskError> {
//!         Ok(())
//!     }
//!     fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
//!         bytes.append(&mut self.0);
//!         self.1.take()
//!     }
//! }
//! impl Part for Echo {
//!     fn save(&self) -> Snapshot { Snapshot::of(&(&self.0, self.1)) }
//!     fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
//!         (self.0, self.1) = snapshot.read()?;
//!         Ok(())
//!     }
//! }
//!
//! /// Absence of a plant.
//! struct NoPlant;
//! impl PlantAccess for NoPlant {
//!     fn sample(&mut self, _: std::ops::Range<usize>) -> Result<&[f64], PlantFault> { Ok(&[]) }
//!     fn actuate(&mut self, _: std::ops::Range<usize>) -> Result<&mut [f64], PlantFault> {
//!         Ok(&mut [])
//!     }
//! }
//!
//! let (byte_time, turnaround) = (SimDuration::from_micros(3), SimDuration::from_micros(2));
//! let bus = Rs485::new("demo", byte_time, turnaround, vec![Box::new(Echo::default())])?;
//! let mut wire = UsbSerial::new("demo", UsbTiming::default(), byte_time, 1, bus)?;
//!
//! wire.send(SimTime::ZERO, b"hello, boards!");
//! let (mut now, mut read) = (SimTime::ZERO, Vec::new());
//! while let Some(wake) = wire.next_wake() {
//!     now = wake;
//!     wire.advance(now, &mut NoPlant)?;
//!     wire.receive(&mut read);
//! }
//! assert_eq!(read, b"hello, boards!");
//! // 94 µs on the bus take five microframes, and the host's program runs 20 µs later.
//! assert_eq!(now, SimTime::ZERO + SimDuration::from_micros(645));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Out of scope: protocols, and packets other than those of USB; different baud rates at the two
//! ends of a wire, parity, flow control and modem lines; the limit of the converter's receive
//! buffer (that of its transmit buffer is reported, not enforced); levels other than high and low;
//! bytes that a receiver detects because of a wrong bit where none was sent; scenario files.

mod addresses;
mod analog_inputs;
mod analog_source;
mod arrivals;
mod burst_faults;
#[cfg(target_os = "linux")]
mod byte_stream;
mod channel;
#[cfg(target_os = "linux")]
mod connection;
mod diagnostics;
mod distortion;
mod duplex;
mod error;
mod fault;
mod faulty;
mod faulty_node;
mod fields;
mod frame_counts;
mod frame_format;
mod frame_reader;
mod frame_selection;
mod framed_driver;
mod framed_node;
mod framer;
mod host_end;
mod line;
mod medium;
mod message;
mod microframes;
mod network_address;
mod node;
mod node_slot;
mod node_wakes;
mod noise;
mod outages;
#[cfg(target_os = "linux")]
mod port;
mod port_info;
#[cfg(target_os = "linux")]
mod port_server;
#[cfg(target_os = "linux")]
mod pty;
mod quantize;
#[cfg(target_os = "linux")]
mod remote_port;
pub mod rfc2217;
mod rs485;
mod sample_choice;
mod sequence_number;
mod traced;
mod traffic;
#[cfg(target_os = "linux")]
mod tty;
mod uart;
mod usb_preset;
mod usb_serial;
mod usb_timing;
#[cfg(not(target_os = "linux"))]
mod without_ports;

pub use addresses::Addresses;
pub use analog_inputs::{AnalogInput, AnalogInputs};
pub use analog_source::AnalogSource;
pub use arrivals::{Arrivals, Piece};
pub use diagnostics::Diagnostics;
pub use duplex::Duplex;
pub use error::{WireError, check_channels};
pub use fault::{Fault, FaultSchedule};
pub use faulty::Faulty;
pub use faulty_node::FaultyNode;
pub use fields::{Fields, bits, mask};
pub use frame_counts::{FrameCounts, Pacing};
pub use frame_format::{FrameFormat, crc16, sum16};
pub use frame_reader::FrameReader;
pub use framed_driver::{FrameOutcome, FramedDriver, Protocol, RequestKind};
pub use framed_node::{Emulation, FramedNode, TxQueue};
pub use framer::{FrameMatch, Framer, FramerState};
pub use host_end::{HostEnd, device_wire, usb_device_wire};
pub use line::{Line, earlier};
pub use message::{FrameError, FramedMessage};
pub use network_address::{NetworkAddress, NetworkTransport};
pub use node::Node;
#[cfg(target_os = "linux")]
pub use port::{SerialPort, ports};
pub use port_info::{PortInfo, UsbInfo};
#[cfg(target_os = "linux")]
pub use port_server::PortServer;
#[cfg(target_os = "linux")]
pub use pty::Pty;
pub use quantize::quantize;
#[cfg(target_os = "linux")]
pub use remote_port::RemotePort;
pub use rs485::{Recipient, Rs485};
pub use sample_choice::SampleChoice;
pub use sequence_number::SequenceNumber;
pub use traced::Traced;
pub use traffic::{TrafficError, TrafficLog};
pub use twinrig_runtime::{
    DriverPhase, FaultDirection, FaultKind, FaultSelection, FrameChoice, FrameCount,
};
pub use uart::Uart;
pub use usb_preset::{TURNAROUND, UsbPreset};
pub use usb_serial::UsbSerial;
pub use usb_timing::{CompletionRule, InRule, OutRule, UsbTiming};
#[cfg(not(target_os = "linux"))]
pub use without_ports::{PortServer, Pty, RemotePort, SerialPort, ports};
