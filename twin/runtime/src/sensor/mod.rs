//! Models of sensors: a stage between the results of tasks and the inputs of the process.
//!
//! A chain sees the results of its task whenever the task is idle and has new ones, in simulated
//! time. Between the transfers it has no access to the plant: it cannot sample more often than the
//! task transfers.

mod chain;
mod error;
mod model;
mod rotation;

pub(crate) use chain::{ChainSite, ChainState, SignalChain, of_task};
pub use error::SensorModelError;
pub use model::SensorModel;
pub(crate) use rotation::QUATERNION;
