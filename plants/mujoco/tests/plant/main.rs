//! The plant, seen from outside.

mod accuracy;
mod allocation;
mod closed_forms;
mod drives;
mod golden;
mod properties;
mod refusals;
mod scene;
mod state;
