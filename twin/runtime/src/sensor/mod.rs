//! Models of sensors: a stage between the results of tasks and the inputs of the process.
//!
//! A chain sees the results of its task whenever the task is idle and has new ones, in simulated
//! time. Between the transfers it has no access to the plant: it cannot sample more often than the
//! task transfers.
//!
//! It takes its samples when a transfer ends, or when the driver has newer results between
//! transfers; the process reads those that have arrived when it reads the task. So a chain without
//! effects changes no bit, and the plant is advanced to no other instant. The executor in real time
//! has no such stage, since a robot has real sensors. There the signals of the plant are those that
//! drivers measure, whether the process reads them or not, so that expectations of them are judged
//! on hardware.

mod chain;
mod error;
mod model;
mod rotation;

pub(crate) use chain::{ChainSite, ChainState, SignalChain, of_task};
pub use error::SensorModelError;
pub use model::SensorModel;
pub(crate) use rotation::QUATERNION;
