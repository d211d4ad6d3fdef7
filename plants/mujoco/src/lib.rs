//! The robot in MuJoCo.

mod engine;

pub use engine::{Engine, EngineError, EngineFault, Warned};
/// The crate that the engine is reached through.
pub use mujoco_rs;
