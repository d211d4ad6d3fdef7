//! Plant with massless legs.
//!
//! Trunk and feet have mass, the segments between them have none (thesis, section 2.7): hip angle
//! and foot position determine the pose of a leg in closed form, and its springs act on foot and
//! trunk by the gradient of their energy. Extensions of the thesis' version: a knee cable that
//! pulls but never pushes, friction in the joints, Coulomb friction and slip on the ground.
//!
//! ```
//! use std::path::Path;
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, Start};
//! use twinrig_massless::{Force, Massless, Options};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotFile::find("cheetah-cub", Path::new(""))?.robot()?;
//! let setup = Setup {
//!     base: Base::Free,
//!     legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
//!     ground: None,
//!     step: SimDuration::from_millis(1),
//!     drives: Drives::Ideal { period: 2e-3 },
//!     abduction: Abduction::Locked,
//!     contacts: Contacts::Feet,
//!     set_point: SetPoint::Held,
//!     start: Start::default(),
//! };
//! let options = Options::new(setup, Force::Solve);
//! let mut plant = Massless::new(&robot, &options, &|signal| signal == "body/position")?;
//! plant.advance(SimTime::ZERO + SimDuration::from_millis(100), &[0.0; 8])?;
//! let mut position = [0.0; 3];
//! let before = 0.133; // upright, at 0.9 of the greatest leg length
//! plant.observe(&mut position);
//! assert!(position[2] < before, "it falls");
//! # Ok(())
//! # }
//! ```
//!
//! Not modelled: inertia of the segments (the full plant has it), ankles folded up to the second
//! segment (where hip and foot do not determine the pose; a stop precedes it), the toe (its spring
//! stays unloaded under a point foot), abduction of the hips and contact of the trunk with
//! rigid constraints, contact of knees and ankles, collisions of the robot with itself, and the
//! drives' electronics.
#![doc = include_str!("../README.md")]
#![allow(
    clippy::inline_always,
    reason = "code with wider registers has to be inlined into the function that enables them"
)]

// Tests name the library as its users do.
#[cfg(test)]
extern crate self as twinrig_massless;

mod compliant;
mod constraints;
mod damping;
mod drives;
mod explicit;
mod flow;
mod flow_error;
mod formulation;
mod inertia;
mod midpoint;
mod mobility;
mod model;
mod motion;
mod plant;
mod posture;
mod pushed;
mod readings;
mod rows;
mod start;
mod state;
mod step;
#[cfg(test)]
mod tests;

pub use model::{Force, MasslessError, Method, Options};
pub use plant::Massless;
pub use twinrig_compliant::lanes::Features;
