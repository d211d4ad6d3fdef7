//! The plant that a rig runs: construction from a robot and options, steps with fallbacks and
//! checks, commands and readings, snapshots, and resuming from the state of another plant. It uses
//! all other rooms.

mod construction;
mod energy_monitor;
pub(crate) mod equations;
mod fallback;
pub(crate) mod flow;
mod posture;
mod readings;
mod rigid;
mod saved;
