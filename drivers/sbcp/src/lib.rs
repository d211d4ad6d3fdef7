//! Simple Binary Communication Protocol of the Oncilla robot (thesis, section 5.3): from the bytes
//! of a packet to a master that exchanges frames with four boards through a bus controller.
//! Sans-IO: bytes and times in, bytes and times out. Equal bytes at equal times give equal answers,
//! and no input causes a panic.
//!
//! ```
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_sbcp::codes::CLASS_MOTORDRIVER;
//! use twinrig_sbcp::{
//!     Address, Instruction, Packet, RegisterTable, Request, Response, Slave, SlaveConfig,
//! };
//! use twinrig_wire::Piece;
//!
//! // A board with id 3, and its reply to the low-latency instruction.
//! let registers = RegisterTable::new(3, 1, &[])?;
//! let mut board = Slave::new(SlaveConfig::new(CLASS_MOTORDRIVER), registers)?;
//! board.set_reply(b"all is well")?;
//!
//! // It receives a request of 10 bytes, complete at 30 µs …
//! let to = Address::new(CLASS_MOTORDRIVER, 3)?;
//! let mut request = Vec::new();
//! Request::new(to, Instruction::LOW_LATENCY, &[0, 1, 0, 2])?.emit(&mut request);
//! let micros = |n| SimTime::ZERO + SimDuration::from_micros(n);
//! let (first, spacing) = (micros(3), SimDuration::from_micros(3));
//! board.receive(Piece { first, spacing, bytes: &request, framing_error: false });
//!
//! // … and starts its answer 10 µs later.
//! let mut answer = Vec::new();
//! assert_eq!(board.poll_transmit(&mut answer), Some(micros(40)));
//! let response = Response::parse(&Packet::new(&answer)?)?;
//! assert_eq!((response.from(), &response.payload[..]), (to, &b"all is well"[..]));
//! # Ok::<(), twinrig_sbcp::SbcpError>(())
//! ```
//!
//! | side | types | connected to |
//! |---|---|---|
//! | host | [`Master`]: requests out, outcomes in | a `twinrig_runtime::Driver` |
//! | bus controller | [`Controller`], and [`ControlledBus`] as a `twinrig_wire::Line` | link and bus |
//! | board | [`Slave`] with its [`RegisterTable`] | a `twinrig_wire::Node` |
//!
//! *Limits of the protocol.* Its checksum is a sum: at a bit error rate of 1e-3 one response in
//! 1700 is wrong but accepted, without any means of detection. It has no sequence numbers, so a
//! board whose answer timed out is not requested again until that answer cannot arrive any more
//! ([`GRACE`]); others are requested meanwhile. A board that transmits without end delays a
//! transfer by 2 ms, is counted (`sbcp/drain_timeouts`), and causes errors.
//!
//! Out of scope: motors, legs and units; registers besides the standard head; ports, collisions and
//! retries. Values that are not published (codes, addresses, some times) are ASSUMED, and collected
//! in [`codes`] and in the defaults of the configurations.

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_sbcp;

mod answer;
mod attribution;
pub mod codes;
mod controlled;
mod controller;
mod controller_config;
mod error;
mod late_answers;
mod link_receiver;
mod master;
mod master_config;
mod packet;
mod parser;
mod registers;
mod request_parser;
mod slave;
mod standard;
#[cfg(test)]
mod tests;
mod uart_transmitter;

pub use codes::{BYTE_TIME, ErrorCode, FRAME_MAX, Instruction, OVERHEAD, PACKET_MAX, PAYLOAD_MAX};
pub use controlled::ControlledBus;
pub use controller::Controller;
pub use controller_config::{ControllerConfig, ControllerCounters, ForwardingMode};
pub use error::SbcpError;
pub use master::Master;
pub use master_config::{GRACE, MasterConfig, MasterCounters, Outcome, RequestError, Topology};
pub use packet::{Address, Packet, Payload, Request, Response, recipient};
pub use parser::{FRAMES, Parser};
pub use registers::{Access, Register, RegisterPlace, RegisterTable, Width};
pub use slave::{AnswerPolicy, Slave, SlaveConfig, SlaveCounters, SlaveEvent};
