//! Parameters of robots. Every physical parameter of a run comes from a robot file, none from code:
//! a missing parameter is an error, never a default, and impossible parameters (a pantograph that
//! does not close, a foot without mass) are rejected with their location in the file.
//!
//! ```
//! use std::path::Path;
//! use twinrig_robot::RobotFile;
//!
//! let file = RobotFile::find("cheetah-cub", Path::new("."))?;
//! let robot = file.robot()?;
//! assert_eq!(robot.legs.len(), 4);
//! assert!((robot.mass() - 1.1).abs() < 1e-12);
//!
//! let error = RobotFile::find("cheeta-cub", Path::new(".")).unwrap_err();
//! assert!(error.to_string().contains("did you mean `cheetah-cub`?"));
//! # Ok::<(), twinrig_robot::RobotError>(())
//! ```
//!
//! The geometry and statics of a leg with these parameters are in [`leg`].
//!
//! Out of scope: simulation, and legs other than pantographs.

mod error;
mod example;
mod file;
pub mod leg;
mod parameters;
mod payload;
mod ranges;
mod read;
pub mod serial;
mod triangle;

pub use error::RobotError;
pub use file::{RobotFile, SERVO_BENCHES};
pub use parameters::{
    Abduction, AbductionAxis, Actuators, Compliance, Contact, GRAVITY, JointFriction, Leg, LegMass,
    LegMount, Motor, Motors, OneSided, Robot, Servo, Spring, Toe, Trunk,
};
pub use payload::{Payload, PointMass};
