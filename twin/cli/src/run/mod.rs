//! Execution of runs, from a rig to a report, in virtual time or on hardware.

pub(crate) mod continuation;
pub(crate) mod execute;
pub(crate) mod executor;
pub(crate) mod hardware;
pub(crate) mod interrupt;
pub(crate) mod judging;
pub(crate) mod observers;
pub(crate) mod recording;
