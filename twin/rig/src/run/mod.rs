//! Execution of runs, from a rig to a report, in virtual time or on hardware.

pub mod continuation;
pub mod execute;
pub(crate) mod executor;
pub mod hardware;
pub mod interrupt;
pub mod judging;
pub mod observers;
pub mod recording;
