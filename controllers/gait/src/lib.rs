//! The open-loop gait controller, with every parameter meaningful in the space in which feet step.
//! Phases are exact: the realised stance share *is* the duty factor, the stance foot moves at an even
//! speed, a locked network of oscillators stays locked to the last bit whatever the elapsed time. All of
//! it is a pure function of what it is told: the same calls give the same bits.
//!
//! ```
//! use std::f64::consts::PI;
//! use twinrig_gait::{DutyMap, FootLocus, LocusShape, Oscillators};
//!
//! let mut network = Oscillators::locked(&[0.0, PI]); // two legs, half a cycle apart
//! let duty = DutyMap::new(0.6)?;
//! let locus = FootLocus::new(&LocusShape::default())?;
//! network.advance(0.002, 3.0, 2.5); // 2 ms at 3 Hz
//! let [x, z] = locus.point(duty.phase(network.turn(0)));
//! assert!(x < 0.0 && z > -0.138); // just after take-off: behind the hip, in the air
//! # Ok::<(), twinrig_gait::GaitError>(())
//! ```
//!
//! [`Cpg`] puts the pieces in a row as a process for a rig; [`Stand`] holds still.
//!
//! # What it does not do
//!
//! It reads no sensor, knows no ground and no body, does not plan, does not smooth a change of its
//! parameters, and draws no noise while it runs.

mod abduction;
mod cpg;
mod duty;
mod error;
mod gait;
mod limb;
mod locus;
mod oscillators;
mod stand;
#[cfg(test)]
mod tests;
mod variables;

pub use abduction::Abduction;
pub use cpg::Cpg;
pub use duty::DutyMap;
pub use error::GaitError;
pub use gait::{Corner, Gait};
pub use locus::{FootLocus, LocusShape};
pub use oscillators::Oscillators;
pub use stand::Stand;
