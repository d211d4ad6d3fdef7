//! What a robot is made of. Every physical parameter of a run comes from a robot file, none from code: a parameter that the
//! file does not give is an error, never a default, and what cannot be built (a pantograph that does not close, a foot
//! without mass) is refused where it stands in the file.
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
//! What it does not do: compute anything with the parameters (that is `twinrig-leg`); know any simulator; model a leg that
//! is no pantograph.

mod error;
mod example;
mod file;
mod parameters;
mod read;

pub use error::RobotError;
pub use file::RobotFile;
pub use parameters::{
    Actuators, GRAVITY, JointFriction, Leg, LegMass, LegMount, Motor, Motors, Robot, Servo, Spring,
    Toe, Trunk,
};
