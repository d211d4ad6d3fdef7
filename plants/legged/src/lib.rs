//! Common parts of all plants of legged robots, which make the plants interchangeable: the
//! [`Setup`] selects what to simulate, [`Start`] the initial legs, [`Signals`] the ports, and the
//! [`Ledger`] keeps the energy balance. [`LeggedPlant`] is the plant: it advances in steps, and
//! handles inputs, pushes, windows, snapshots and faults. Its [`Dynamics`] are state and equations
//! of motion with [`Readings`]; every plant of a robot then has the same ports, the same initial
//! pose and the same errors.
//!
//! ```
//! use std::path::Path;
//! use twinrig_kernel::SimDuration;
//! use twinrig_robot::leg::Pantograph;
//! use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Signals, StartPose};
//! use twinrig_robot::RobotFile;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotFile::find("cheetah-cub", Path::new(""))?.robot()?;
//! let setup = Setup {
//!     base: Base::Fixed,
//!     legs: vec!["LF".to_owned()],
//!     ground: None,
//!     step: SimDuration::from_millis(1),
//!     drives: Drives::None,
//!     abduction: Abduction::Locked,
//!     contacts: Contacts::Feet,
//!     set_point: SetPoint::Held,
//!     start: StartPose { q: [0.2, -0.1, 0.1], rates: [0.0; 3] }.into(),
//! };
//! let mount = setup.selected_mounts(&robot)?[0];
//! let start = setup.start.of_leg(&mount.name, &Pantograph::new(&mount.leg)?)?;
//! assert_eq!(start.command.hip, 0.2);
//! assert!(start.command.knee > 0.0, "a bent knee winds up the cable");
//!
//! let selected = |name: &str| name.ends_with("torque") || name.ends_with("angles");
//! let signals = Signals::new(&["LF"], &setup, &selected);
//! let names: Vec<&str> = signals.ports().iter().map(|port| port.name.as_str()).collect();
//! assert_eq!(names, ["leg/LF/angles"], "without drives: no commands, no torques");
//! # Ok(())
//! # }
//! ```
//!
//! Out of scope: equations of motion, state, integration and contact forces, which belong to each
//! plant; options of a single plant; and the scenario language, which the builder of plants
//! translates.

mod abduction;
mod assembly;
mod constraints;
mod dynamics;
mod error;
mod external_load;
mod friction;
mod ground_friction;
mod limits;
mod plant;
mod posture;
mod push;
mod push_schedule;
mod readings;
mod segment;
mod serial;
mod setup;
mod signals;
mod slide;
mod start;
mod validation;
mod window;

pub use abduction::{abduction_entry, adopt_abduction};
pub use constraints::Constraints;
pub use dynamics::{Dynamics, FromRobot, PartFault};
pub use error::{LeggedError, PushProblem, positive};
pub use external_load::{ExternalLoad, StepLoad};
pub use friction::Friction;
pub use plant::LeggedPlant;
pub use posture::{LegPosture, Posture};
pub use push::{Push, PushShape, PushTarget};
pub use push_schedule::PushSchedule;
pub use readings::{FootMotion, Readings, surfaces_below};
pub use segment::Segment;
pub use serial::SerialServos;
pub use setup::{
    Abduction, Base, Contacts, DriveModels, Drives, FirmwarePlace, Motors, Servos, Setup,
};
pub use signals::Signals;
pub use slide::{TangentialImpulse, taken_by_friction};
pub use start::{LegStart, Start, StartPose};
pub use twinrig_actuator::{Ramp, SetPoint, SetPoints, StepInputs};
pub use twinrig_runtime::{Ledger, NegativeDissipation, Stored};
pub use window::{GroundImpulses, Window};

/// Maximum number of legs.
pub const LEGS: usize = 4;
