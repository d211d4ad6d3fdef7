//! Gait controllers with parameters in the space of the feet: one open-loop, one with feedback of
//! the loads of the legs. Phases are exact: open-loop, the realised stance share *is* the duty
//! factor and the stance foot moves at constant speed, unless the formulas of the thesis are chosen
//! ([`DutyRule`], [`StanceCurve`]), and a locked network of oscillators stays
//! locked to the last bit for any elapsed time; with feedback, a phase under a constant load is the
//! closed solution for any elapsed time. The outputs are a pure function of the sequence of calls:
//! the same calls give the same bits.
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
//! [`Cpg`] combines these parts to a process of a rig; [`Tegotae`] has phases with feedback in place
//! of network and duty map; [`Planner`] changes the steps of a [`Cpg`] before an obstacle;
//! [`Stand`] holds a constant pose.
//!
//! # Limits
//!
//! No sensors but loads, velocity and attitude of the trunk ([`Abduction::Capture`]) and, for
//! [`Planner`], joint angles; no model of ground or body, and no smoothing of parameter changes.
//! Obstacles are given, not perceived.

mod abduction;
mod capture;
mod cpg;
mod duty;
mod error;
mod gait;
mod leg_commands;
mod limb;
mod load_signal;
mod locus;
mod oscillators;
mod phase_meter;
mod phases;
mod planner;
mod stance_curve;
mod stand;
mod steering;
mod tegotae;
mod tegotae_rule;
#[cfg(test)]
mod tests;
mod variables;

pub use abduction::Abduction;
pub use cpg::Cpg;
pub use duty::{DutyMap, DutyRule};
pub use error::GaitError;
pub use gait::{Corner, Gait};
pub use locus::{FootLocus, LocusShape};
pub use oscillators::Oscillators;
pub use planner::Planner;
pub use stance_curve::StanceCurve;
pub use stand::Stand;
pub use tegotae::{Tegotae, TegotaeStart};
pub use tegotae_rule::{FixedPoint, low_pass};
