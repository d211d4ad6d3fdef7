//! Optical force sensors (`OptoForce`), version 1.7 of their protocol: the driver that sets one up and keeps its newest sample, and
//! an emulated sensor that measures a force of the plant with the filter, the counts and the pace of the real one.
//!
//! The sensor streams on its own clock, whether anybody listens or not. A transfer takes the newest sample there is and
//! never waits, unless it is told to wait for a fresh one ([`Take`]).
//!
//! ```
//! use twinrig_optoforce::{OptoForce, Speed};
//!
//! let mut sensor = OptoForce::new("optoforce", "leg/LF/foot/force");
//! sensor.speed = Speed::Hz1000;
//!
//! let driver = sensor.driver()?; // left of the wire
//! let node = sensor.sensor()?; // right of it
//! # let _ = (driver, node);
//! # Ok::<(), twinrig_optoforce::OptoForceError>(())
//! ```
//!
//! What it does not do: bring what sensors with four or six axes send (the parser knows their frames, the driver counts
//! them as foreign); model noise, drift or cross-talk between the axes.

mod assumed;
mod config;
mod driver;
pub mod protocol;
mod sensor;

pub use config::{OptoForce, OptoForceError, Take};
pub use driver::{OptoForceDriver, OptoForceProtocol};
pub use protocol::{Cutoff, Speed};
pub use sensor::{OptoForceEmulation, OptoForceSensor};
