//! Dynamixel servos without input or output: packets of protocols 1.0 and 2.0, control tables as
//! data, the driver of the host, and emulated servos. Bytes and times in, bytes and times out; no
//! clock, port or thread.
//!
//! | part | contents |
//! |---|---|
//! | packets | [`ProtocolVersion`] encodes and matches them, [`Parser`] finds them in a stream |
//! | instructions | [`Request`], with [`Instruction`] and [`ErrorNumber`] |
//! | control tables | [`ServoModel`] and its [`Register`]s; those of series in [`x`] and [`ax`] |
//! | servo | [`Registers`], [`Responder`], [`ServoFirmware`]; [`ServoNode`] of all |
//! | bus | [`ServoBusConfig`], of which [`DynamixelDriver`] and [`ServoBusWire`] are made |
//! | timing | [`timing`]: loops of a host over a bus, predicted and judged |
//!
//! ```
//! use twinrig_dynamixel::{ProtocolVersion, Request, Responder, Span, x};
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_wire::Piece;
//!
//! let byte_time = SimDuration::from_micros(10);
//! let mut servo = Responder::new(x::XL330_M288.model, 7, byte_time);
//! let mut request = Vec::new();
//! let span = Span { address: 0, length: 2 };
//! Request::Read(span).encode(ProtocolVersion::Two, 7, &mut request)?;
//!
//! let first = SimTime::ZERO + byte_time;
//! let piece = Piece { first, spacing: byte_time, bytes: &request, framing_error: false };
//! servo.receive(piece);
//! servo.handle(piece.last());
//!
//! // The answer: model 1200, 500 µs after the request of 14 bytes.
//! let mut answer = Vec::new();
//! let start = servo.poll_transmit(&mut answer);
//! assert_eq!(start, Some(SimTime::ZERO + SimDuration::from_micros(640)));
//! assert_eq!(answer[8..11], [0, 0xb0, 0x04]);
//! # Ok::<(), twinrig_dynamixel::PacketError>(())
//! ```
//!
//! Out of scope: USB and UART (`twinrig-wire`), the motor (`twinrig-actuator`), baud rates other
//! than that of the bus, secondary identifiers, and the time of a restart.

pub mod ax;
mod bus;
mod codes;
mod config;
mod driver;
mod error;
mod fast;
mod firmware;
mod frames;
mod node;
mod parser;
mod profile;
mod protocol;
mod register;
mod registers;
mod request;
mod responder;
mod table;
pub mod timing;
pub mod x;

pub use bus::ServoBusWire;
pub use codes::{ErrorNumber, Errors, Instruction};
pub use config::{JointSignals, ReadPattern, ServoBusConfig, ServoConfig};
pub use driver::DynamixelDriver;
pub use error::{PacketError, ServoBusError};
pub use firmware::{BridgeCommand, ServoFirmware, ServoKind, ServoMeasurements};
pub use node::ServoNode;
pub use parser::{Parser, Received};
pub use profile::{Profile, ProfileLimits};
pub use protocol::{Packet, ProtocolVersion, Status};
pub use register::{Access, Bounds, ByteOrder, Format, Register, Source, registers};
pub use registers::Registers;
pub use request::{BulkReads, Kept, Request, Span};
pub use responder::{Responder, ResponderCounters};
pub use table::{
    BaudRates, CommonRegisters, Derived, EepromLock, Indirect, PositionScale, ReturnDelay,
    ServoModel,
};
