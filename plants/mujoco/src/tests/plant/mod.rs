//! Tests of the plant through its public interface.

mod abduction;
mod accuracy;
mod allocation;
mod closed_forms;
mod drives;
mod fixture;
mod loads;
mod properties;
mod refusals;
mod state;
mod step_only;
