//! The robot in Rapier.

mod assembly;
mod border;
mod contact;
mod drives;
mod model;
mod options;
mod plant;
mod readings;
mod robot;
mod rope;
mod step;
mod world;

pub use options::{Joints, Options, RapierError, Softness, Solver};
pub use plant::Rapier;
