//! Two measuring boards on USB: a bridge for load cells (1046: four channels of 24 bits) and an
//! interface kit (1018: eight analog inputs of 10 bits). The driver sets up a board and keeps its
//! newest readings; an emulated board samples signals of the plant, with the resolution, the range
//! and the rate of the real one.
//!
//! A board reports when USB polls it, every 8 ms: the bridge once per data interval, the interface
//! kit when an input has changed. A transfer returns the newest readings without waiting.
//!
//! ```
//! use twinrig_devices::FramedDevice;
//! use twinrig_devices::phidget::{AnalogInput, Board, Gain, Phidget};
//! use twinrig_kernel::SimDuration;
//! use twinrig_wire::AnalogSource;
//!
//! let analog_source = Some(AnalogSource {
//!     signal: "leg/LF/foot/force".into(),
//!     component: 2,
//!     scale: 1e-5, // 10 µV/V per newton
//!     offset: 0.0,
//! });
//! let mut bridge = Phidget::new("phidget", Board::Bridge {
//!     interval: SimDuration::from_millis(8),
//!     gain: Gain::X64,
//! });
//! bridge.inputs.push(AnalogInput { channel: 0, analog_source });
//!
//! let driver = bridge.driver()?; // host side of the wire
//! let node = bridge.node()?; // device side
//! # let _ = (driver, node);
//! # Ok::<(), twinrig_devices::phidget::PhidgetError>(())
//! ```
//!
//! **Limits.** No digital inputs and outputs, no noise, no averaging over a data interval. The
//! protocol over USB is not documented: the frames are ASSUMED ([`protocol`]).

use twinrig_kernel::SimDuration;

use crate::FramedDevice;

mod assumed;
mod board;
mod config;
mod driver;
pub mod protocol;
#[cfg(test)]
mod tests;

pub use board::{PhidgetBoard, PhidgetEmulation};
pub use config::{Board, Phidget, PhidgetError};
pub use driver::{PhidgetDriver, PhidgetProtocol};
pub use protocol::Gain;
pub use twinrig_wire::AnalogInput;

impl FramedDevice for Phidget {
    type Error = PhidgetError;
    type Protocol = PhidgetProtocol;
    type Emulation = PhidgetEmulation;

    const BYTE_TIME: SimDuration = assumed::BYTE_TIME;

    fn examples() -> Vec<Self> {
        let boards = [("bridge", Board::default()), ("kit", Board::INTERFACE_KIT)];
        boards.map(|(name, board)| Self::new(name, board)).into()
    }

    fn sides(&self) -> Result<(PhidgetProtocol, PhidgetEmulation), PhidgetError> {
        self.check()?;
        let emulation = PhidgetEmulation::new(self.clone());
        Ok((PhidgetProtocol(self.clone()), emulation))
    }
}
