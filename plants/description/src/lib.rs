//! Robots in the description formats of other programs: [`urdf`] writes a robot as URDF.
//!
//! ```
//! use std::path::Path;
//! use twinrig_robot::RobotFile;
//!
//! let robot = RobotFile::find("cheetah-cub", Path::new("."))?.robot()?;
//! let text = twinrig_description::urdf(&robot)?;
//! assert!(text.contains("<joint name=\"LF_knee\" type=\"revolute\">"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Out of scope: simulation, meshes, and MJCF out of robots (`twinrig-mujoco`).

mod urdf;

pub use urdf::urdf;
