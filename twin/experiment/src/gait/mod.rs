//! Runs of gaits for studies of footsteps.

pub(crate) mod run;
pub(crate) mod scene;
mod slip_meter;
pub(crate) mod task;
