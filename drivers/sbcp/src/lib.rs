//! The Simple Binary Communication Protocol (thesis, section 5.3), from the bytes of a packet to a master that
//! exchanges frames with four boards, without input or output of its own.

mod answer;
pub mod codes;
mod controlled;
mod controller;
mod error;
mod intake;
mod listener;
mod master;
mod outbox;
mod packet;
mod parser;
mod registers;
mod slave;
mod standard;

pub use codes::{BYTE_TIME, ErrorCode, FRAME_MAX, Instruction, OVERHEAD, PACKET_MAX, PAYLOAD_MAX};
pub use controlled::Controlled;
pub use controller::{Controller, ControllerConfig, ControllerCounters, Passing};
pub use error::SbcpError;
pub use master::{Failure, Master, MasterConfig, MasterCounters, Outcome, Topology};
pub use packet::{Address, Packet, Payload, Request, Response};
pub use parser::Parser;
pub use registers::{Access, Register, RegisterTable, Width};
pub use slave::{AnswerPolicy, Slave, SlaveConfig, SlaveCounters, SlaveEvent};
