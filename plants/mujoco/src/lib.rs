//! The robot in MuJoCo.

mod addresses;
mod drives;
mod engine;
mod felt;
mod flow;
mod frame;
mod mjcf;
mod model;
pub mod model_file;
mod options;
mod plant;
mod rates;
mod readings;
mod stages;

pub use engine::{Engine, EngineError, EngineFault, Warned};
pub use mjcf::mjcf;
/// The crate that the engine is reached through.
pub use mujoco_rs;
pub use options::{Closing, Cone, Coordinates, Integrator, MujocoError, Numerics, Options, Solver};
pub use plant::Mujoco;
