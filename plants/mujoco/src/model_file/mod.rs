//! Plants from any MJCF model: its actuators, joints, bodies and sensors as signals.
//!
//! [`ModelFile`] is the compiled model; [`ModelSignals`] declare the signals; [`BoundModel`] is
//! both, checked against each other; [`Mjcf`] is the plant.

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
