//! Execution of runs, from a rig to a report, in virtual time or on hardware.

pub mod continuation;
pub mod course;
pub mod execute;
pub mod execution;
pub mod executor;
pub mod hardware;
pub mod interrupt;
pub mod judging;
pub mod observers;
pub mod recorded;
pub mod recording;
pub mod repetition;
mod stopwatch;
