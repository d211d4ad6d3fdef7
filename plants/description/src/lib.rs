//! Robots in the description formats of other programs: [`urdf`] writes a robot as URDF,
//! [`import`] makes a robot file of URDF or MJCF.
//!
//! ```
//! use std::path::Path;
//! use twinrig_description::{Language, import, urdf};
//! use twinrig_robot::RobotFile;
//!
//! let robot = RobotFile::find("cheetah-cub", Path::new("."))?.robot()?;
//! let text = urdf(&robot)?;
//! assert!(text.contains("<joint name=\"LF_knee\" type=\"revolute\">"));
//!
//! let again = import(Language::Urdf, "cheetah-cub.urdf", &text, None)?;
//! let again = RobotFile::parse("again.toml", &again.text)?.robot()?;
//! assert!((again.legs[0].leg.l2 - robot.legs[0].leg.l2).abs() < 1e-12);
//!
//! let error = import(Language::Urdf, "pup.urdf", "<robot><link/></robot>", None).unwrap_err();
//! assert!(error.to_string().contains("pup.urdf:1:8"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Out of scope: simulation, meshes, xacro, SDF, and MJCF out of robots (`twinrig-mujoco`).

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_description;

mod import;
mod quadruped;
mod read_mjcf;
mod read_urdf;
mod robot_file;
#[cfg(test)]
mod tests;
mod tree;
mod urdf;
mod xml;

pub use import::{Language, import};
pub use robot_file::Imported;
pub use urdf::urdf;
