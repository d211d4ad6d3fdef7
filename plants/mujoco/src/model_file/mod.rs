//! Any MJCF model as a plant: its actuators, joints, bodies and sensors under the names of signals.
//!
//! [`ModelFile`] is the model, compiled; [`Wishes`] say which signal is what of it; [`Wired`] is both, checked against each
//! other; [`Mjcf`] is the plant.

mod contact;
mod error;
mod file;
mod legs;
mod meaning;
mod plant;
mod unit;
mod wired;
mod wishes;

pub use error::{Misfit, ModelFileError, Place, SignalError};
pub use file::ModelFile;
pub use legs::Leg;
pub use plant::Mjcf;
pub use wired::Wired;
pub use wishes::{Input, Output, Thing, Wishes};
