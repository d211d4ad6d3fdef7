//! Tests of the scenario language and of its judge.

mod bounds;
mod buses;
mod common;
mod compare;
mod falls;
mod footsteps;
mod gait;
mod gets_up;
mod judge;
mod language;
mod malformed;
mod many;
mod memory;
mod observations;
mod periods;
mod recovery;
mod robustness;
mod scene;
mod schema;
mod sensors;
mod sequence;
mod streaming;
mod tracking;
mod validator;
mod warnings;
mod witness;
