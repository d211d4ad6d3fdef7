//! The motordriver boards of Oncilla.
mod assumed;
mod board;
mod config;
mod firmware;
mod pid;
mod punctuality;
mod registers;
mod reply;
mod smooth;
mod units;
mod watchdog;
pub use board::MotorBoard;
pub use config::*;
pub use units::{Joint, Side};
