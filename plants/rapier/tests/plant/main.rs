//! Tests of the plant.

mod abduction;
mod drives;
mod energy;
mod errors;
mod faults;
mod fixture;
mod ground;
mod hanging_legs;
mod initial_states;
mod partial_steps;
mod restore;
mod step_only;
