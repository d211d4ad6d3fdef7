//! Optical force sensors (`OptoForce`), version 1.7 of their protocol: the driver, which configures
//! a sensor and keeps its newest sample, and an emulated sensor that measures a force of the plant
//! with the filter, the resolution and the rate of the real one.
//!
//! The sensor streams by its own clock, without requests. A transfer returns the newest sample
//! without waiting, unless it is configured to wait for a fresh one ([`SampleChoice`]).
//!
//! ```
//! use twinrig_devices::FramedDevice;
//! use twinrig_devices::optoforce::{OptoForce, Speed};
//!
//! let mut sensor = OptoForce::new("optoforce", "leg/LF/foot/force");
//! sensor.speed = Speed::Hz1000;
//!
//! let driver = sensor.driver()?; // host side of the wire
//! let node = sensor.node()?; // device side
//! # let _ = (driver, node);
//! # Ok::<(), twinrig_devices::optoforce::OptoForceError>(())
//! ```
//!
//! **Limits.** Groups of four sensors and sensors with six axes are not supported (the parser
//! decodes their frames, the driver counts them as foreign). Noise, drift and cross-talk between
//! the axes are not modelled.

use twinrig_kernel::SimDuration;

use crate::FramedDevice;

mod assumed;
mod config;
mod driver;
pub mod protocol;
mod sensor;
#[cfg(test)]
mod tests;

pub use config::{OptoForce, OptoForceError};
pub use driver::{OptoForceDriver, OptoForceProtocol};
pub use protocol::{Cutoff, Speed};
pub use sensor::{OptoForceEmulation, OptoForceSensor};
pub use twinrig_wire::SampleChoice;

impl FramedDevice for OptoForce {
    type Error = OptoForceError;
    type Protocol = OptoForceProtocol;
    type Emulation = OptoForceEmulation;

    /// 1 Mbaud, 8N1.
    const BYTE_TIME: SimDuration = SimDuration::from_micros(10);

    fn examples() -> Vec<Self> {
        let mut sensor = Self::new("optoforce", "force");
        sensor.take = SampleChoice::Fresh;
        vec![sensor]
    }

    fn sides(&self) -> Result<(OptoForceProtocol, OptoForceEmulation), OptoForceError> {
        self.check()?;
        let emulation = OptoForceEmulation::new(self.clone());
        Ok((OptoForceProtocol(self.clone()), emulation))
    }
}
