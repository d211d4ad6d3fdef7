//! Plant with legs of full inertia, in generalised coordinates.
//!
//! Trunk and every segment have mass. Springs, stops, the cable of the knee, motors with torque
//! limits and the ground act on them (thesis, chapter 2, with its formulas corrected). Events, such
//! as a stop that is reached or a foot that lands, are located in time and solved as
//! complementarity problems, so that the default method keeps its fourth order across them. The
//! equations are [below](#full-plant), with the symbols of the code.
//!
//! ```
//! use std::path::Path;
//! use twinrig_kernel::{SimDuration, SimTime};
//! use twinrig_lcp::{Constraints, Features, Lcp, Method, Options};
//! use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup, StartPose};
//! use twinrig_robot::RobotFile;
//! use twinrig_runtime::Plant;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = RobotFile::find("cheetah-cub", Path::new(""))?.robot()?;
//! // The legs hang from a fixed trunk, are released, and swing (thesis, section 2.5.1).
//! let (hip, knee) = (10_f64.to_radians(), -9.5_f64.to_radians());
//! let options = Options {
//!     setup: Setup {
//!         base: Base::Fixed,
//!         legs: robot.legs.iter().map(|mount| mount.name.clone()).collect(),
//!         ground: None,
//!         step: SimDuration::from_millis(2),
//!         drives: Drives::None,
//!         abduction: Abduction::Locked,
//!         contacts: Contacts::Feet,
//!         set_point: SetPoint::Held,
//!         start: StartPose { q: [hip, knee, -knee], rates: [0.0; 3] }.into(),
//!     },
//!     constraints: Constraints::Rigid,
//!     method: Method::Rk4,
//!     tolerance: 1e-6,
//!     toe: false,
//!     features: Features::Detected,
//! };
//! let mut plant = Lcp::new(&robot, &options, &|signal| signal == "leg/LF/foot/position")?;
//! plant.advance(SimTime::ZERO + SimDuration::from_millis(300), &[])?;
//! let mut foot = [0.0; 3];
//! plant.observe(&mut foot);
//! let balance = plant.energy();
//! assert!(balance.residual.abs() < 1e-4 * balance.exchanged);
//! assert!(plant.work().events > 0, "stops were reached");
//! # Ok(())
//! # }
//! ```
//!
//! Not modelled: hip abduction, and contact of other parts than the feet, with rigid constraints or
//! toe joints; bending of segments, collisions of the robot with itself, the electronics of the
//! drives, and the reaction of a drive's rotor on the trunk, which is small behind a gear.
#![doc = include_str!("../README.md")]
#![allow(
    clippy::needless_range_loop,
    reason = "matrices are indexed as in the formulas"
)]
#![allow(
    clippy::inline_always,
    reason = "inlining exposes literal loop lengths and keeps values in registers"
)]

// The rooms of this crate; an arrow points to a room that is used:
// plant → integrators → constraints → model, and plant → compliant → model.
mod compliant;
mod constraints;
#[cfg(test)]
mod fixtures;
mod formulation;
mod integrators;
mod model;
mod options;
mod plant;

pub use formulation::Lcp;
pub use options::{LcpError, Method, Options};
pub use plant::equations::{Equations, Posture};
pub use twinrig_compliant::lanes::Features;
pub use twinrig_legged::Constraints;
