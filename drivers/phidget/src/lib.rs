//! Two boards that measure over USB: a bridge for load cells (1046: four channels of 24 bits) and an interface kit
//! (1018: eight analog inputs of 10 bits). The driver sets one up and keeps its newest readings; an emulated board reads
//! signals of the plant, with the converter, the range and the pace of the real one.
//!
//! A board reports when USB asks it, every 8 ms at most: the bridge once a data interval, the interface kit when an
//! input has changed. A transfer takes the newest readings there are and never waits.
//!
//! ```
//! use twinrig_phidget::{Board, Gain, Input, Phidget};
//! use twinrig_kernel::SimDuration;
//! use twinrig_wire::Tap;
//!
//! let cell = Tap { signal: "leg/LF/foot/force".into(), component: 2, scale: 1e-5, offset: 0.0 };
//! let mut bridge = Phidget::new("phidget", Board::Bridge {
//!     interval: SimDuration::from_millis(8),
//!     gain: Gain::X64,
//! });
//! bridge.inputs.push(Input { channel: 0, tap: cell }); // 10 µV/V for a newton
//!
//! let driver = bridge.driver()?; // left of the wire
//! let node = bridge.board()?; // right of it
//! # let _ = (driver, node);
//! # Ok::<(), twinrig_phidget::PhidgetError>(())
//! ```
//!
//! What it does not do: digital inputs and outputs; noise; averaging over a data interval. What passes over USB is
//! documented nowhere: the frames are ASSUMED ([`protocol`]).

mod assumed;
mod board;
mod config;
mod driver;
pub mod protocol;

pub use board::{PhidgetBoard, PhidgetEmulation};
pub use config::{Board, Input, Phidget, PhidgetError};
pub use driver::{PhidgetDriver, PhidgetProtocol};
pub use protocol::Gain;
