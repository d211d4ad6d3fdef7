//! Servo and analog board of the robot's computer (RB-110): the driver, which transmits the widths
//! of servo pulses and reads the analog inputs, and an emulated board whose pulses command the
//! servos of a plant. Driver and board exchange bytes only: the width of a pulse, in ticks of 20
//! ns, *is* the command.
//!
//! A transfer takes one period of the pulses, as on the robot, where the I/O task sleeps for that
//! time. With pulses every 20 ms and a control period of 10 ms the task takes part in every second
//! step.
//!
//! ```
//! use twinrig_devices::FramedDevice;
//! use twinrig_devices::rb110::{PulseMap, Rb110};
//!
//! let board = Rb110::with_servos("rb110", PulseMap::ONCILLA, &[(15, "LF"), (13, "RF")]);
//! assert_eq!(board.servos[0].command, "leg/LF/abduction/command");
//! assert_eq!(PulseMap::ONCILLA.ticks(0.0), Some((60_000, false))); // 1.2 ms
//!
//! let driver = board.driver()?; // host side of the wire
//! let node = board.node()?; // device side
//! # let _ = (driver, node);
//! # Ok::<(), twinrig_devices::rb110::Rb110Error>(())
//! ```
//!
//! **Limits.** The servo is not modelled here but in the plant (lag, speed, dead band). A joint
//! whose pulses have stopped is not released: the plant keeps the last command. The protocol of the
//! real board is not published: the frames are ASSUMED ([`protocol`]).

use twinrig_kernel::SimDuration;

use crate::FramedDevice;

mod assumed;
mod board;
mod config;
mod driver;
pub mod protocol;
#[cfg(test)]
mod tests;

pub use board::{Rb110Board, Rb110Emulation};
pub use config::{AdcRange, PulseMap, Rb110, Rb110Error, ServoLine};
pub use driver::{Rb110Driver, Rb110Protocol};
pub use twinrig_wire::AnalogInput;

impl FramedDevice for Rb110 {
    type Error = Rb110Error;
    type Protocol = Rb110Protocol;
    type Emulation = Rb110Emulation;

    const BYTE_TIME: SimDuration = assumed::BYTE_TIME;

    fn examples() -> Vec<Self> {
        let mut board = Self::with_servos("rb110", PulseMap::ONCILLA, &[(15, "LF")]);
        board.analog = vec![AnalogInput {
            channel: 3,
            analog_source: None,
        }];
        vec![board]
    }

    fn sides(&self) -> Result<(Rb110Protocol, Rb110Emulation), Rb110Error> {
        self.check()?;
        let emulation = Rb110Emulation::new(self.clone());
        Ok((Rb110Protocol(self.clone()), emulation))
    }
}
