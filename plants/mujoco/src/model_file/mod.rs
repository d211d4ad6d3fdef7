//! Any MJCF model as a plant: its actuators, joints, bodies and sensors under the names of signals.
//!
//! [`ModelFile`] is the model, compiled; [`ModelSignals`] say which signal is what of it; [`BoundModel`] is both, checked against each
//! other; [`Mjcf`] is the plant.

mod bound;
mod contact;
mod error;
mod file;
mod legs;
mod plant;
mod signals;
mod source;
mod unit;

pub use bound::BoundModel;
pub use error::{ModelFileError, Place, SignalError, SignalMismatch};
pub use file::ModelFile;
pub use legs::Leg;
pub use plant::Mjcf;
pub use signals::{ElementKind, Input, ModelSignals, Output};
