//! The servo and analog board of the robot's computer (RB-110): the driver that gives it the widths of servo pulses and
//! reads its analog inputs, and an emulated board whose pulses turn the servos of a plant. Driver and board share nothing
//! but bytes: the width of a pulse, in ticks of 20 ns, *is* the command.
//!
//! A transfer takes one period of the pulses, as on the robot, where the task that does it sleeps for it. With pulses
//! every 20 ms and a control period of 10 ms the task takes part in every second step.
//!
//! ```
//! use twinrig_rb110::{PulseMap, Rb110};
//!
//! let board = Rb110::with_servos("rb110", PulseMap::ONCILLA, &[(15, "LF"), (13, "RF")]);
//! assert_eq!(board.servos[0].command, "leg/LF/abduction/command");
//! assert_eq!(PulseMap::ONCILLA.ticks(0.0), Some((60_000, false))); // 1.2 ms
//!
//! let driver = board.driver()?; // left of the wire
//! let node = board.board()?; // right of it
//! # let _ = (driver, node);
//! # Ok::<(), twinrig_rb110::Rb110Error>(())
//! ```
//!
//! What it does not do: model the servo, which is the plant's affair (lag, speed, dead band); let go of a joint whose
//! pulses have stopped: the plant keeps the last command. How the real board is spoken to is published nowhere: the frames
//! are ASSUMED ([`protocol`]).

mod assumed;
mod board;
mod config;
mod driver;
pub mod protocol;

pub use board::{Rb110Board, Rb110Emulation};
pub use config::{AdcRange, AnalogInput, PulseMap, Rb110, Rb110Error, ServoLine};
pub use driver::{Rb110Driver, Rb110Protocol};
