//! The plant that a rig runs: construction from a robot and options, commands and readings,
//! snapshots and the takeover of another plant's state. It uses all other rooms.

mod construction;
mod energy_monitor;
pub(crate) mod equations;
mod fallback;
pub(crate) mod flow;
mod posture;
mod readings;
mod rigid;
mod saved;
