//! tbd
mod amplifier;
mod butterworth;
mod error;
mod estimator;
pub mod fit;
mod kalman;
mod model;
mod objective;
mod response;
mod settings;
mod track;

pub use amplifier::ChargeAmplifier;
pub use butterworth::{Butterworth, Section};
pub use error::EstimateError;
pub use estimator::{Channel, Counters, Estimate, ForceEstimator, Measurement, Outcome};
pub use kalman::{Innovation, Kalman};
pub use model::{Decay, Model, StateSettings};
pub use objective::{Objective, TunedSample};
pub use response::{ForceResponse, Gradient, Hysteresis, Sigmoid};
pub use settings::{Piezoresistive, RECOVERY, Settings};
