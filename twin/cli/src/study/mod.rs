//! Studies: builders of their plants and rigs.

pub(crate) mod builder;
pub(crate) mod coupling_builder;
pub(crate) mod feedback_cases;
pub(crate) mod gait_scene;
mod load_observer;
pub(crate) mod load_recorder;
pub(crate) mod modulation_cases;
pub(crate) mod robustness_cases;
mod scaled;
mod selection;
mod slip_meter;
mod sufficient_candidates;
pub(crate) mod sufficient_omission;
pub(crate) mod sufficient_runs;
pub(crate) mod transition_cases;
