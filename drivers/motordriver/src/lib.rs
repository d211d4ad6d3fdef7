//! The motordriver boards of Oncilla.

mod assumed;
mod board;
mod bus;
mod config;
mod driver;
mod error;
mod firmware;
mod leg;
mod pid;
mod punctuality;
mod registers;
mod reply;
mod session;
mod smooth;
mod stack;
mod units;
mod watchdog;

pub use board::MotorBoard;
pub use bus::{Bus, BusWire};
pub use config::{
    BoardConfig, BusConfig, BusTopology, FirmwareConfig, Following, Generation, Interpolation,
    SessionConfig, SessionGains,
};
pub use driver::MotorDriver;
pub use error::BusError;
pub use stack::Stack;
pub use units::{Joint, Side};
