//! What every plant of a legged robot shares, so that one can be exchanged for another: the [`Setup`] that says what to
//! simulate, where the legs [`Start`], which [`Signals`] there are, and the [`Ledger`] that balances the energy. A plant
//! adds its state and how it moves, and answers [`Readings`]; the same robot then has the same ports, starts in the same
//! place and is refused for the same reasons, whichever plant it is.
//!
//! ```
//! use twinrig_kernel::SimDuration;
//! use twinrig_leg::Pantograph;
//! use twinrig_legged::{Base, Drives, Setup, Signals, StartPose};
//! use twinrig_robot::RobotFile;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = include_str!("../../../robots/cheetah-cub.toml");
//! let robot = RobotFile::parse("cheetah-cub.toml", text)?.robot()?;
//! let setup = Setup {
//!     base: Base::Fixed,
//!     legs: vec!["LF".to_owned()],
//!     ground: None,
//!     step: SimDuration::from_millis(1),
//!     drives: Drives::None,
//!     start: StartPose { q: [0.2, -0.1, 0.1], rates: [0.0; 3] }.into(),
//! };
//! let mount = setup.chosen(&robot)?[0];
//! let start = setup.start.of_leg(&mount.name, &Pantograph::new(&mount.leg)?)?;
//! assert_eq!(start.command.hip, 0.2);
//! assert!(start.command.knee > 0.0, "a bent knee winds the cable");
//!
//! let signals = Signals::new(&["LF"], &setup, &|name| name.ends_with("torque") || name.ends_with("angles"));
//! let names: Vec<&str> = signals.ports().iter().map(|port| port.name.as_str()).collect();
//! assert_eq!(names, ["leg/LF/angles"], "no drives, no commands, no torques");
//! # Ok(())
//! # }
//! ```
//!
//! What is not here: equations of motion, state, integration and contact forces, which are each plant's own; options of
//! one plant alone; and the language of scenarios, which whoever builds plants translates.

mod error;
mod ledger;
mod posture;
mod readings;
mod segment;
mod setup;
mod signals;
mod slide;
mod sound;
mod start;
mod window;

pub use error::{LeggedError, positive};
pub use ledger::{Ledger, NegativeDissipation, Stored};
pub use posture::{LegPosture, Posture};
pub use readings::Readings;
pub use segment::Segment;
pub use setup::{Base, Drives, Fitted, Motors, Servos, Setup};
pub use signals::Signals;
pub use slide::{Slide, taken_by_friction};
pub use start::{LegStart, Start, StartPose};
pub use window::Window;

/// The legs there is room for.
pub const LEGS: usize = 4;
