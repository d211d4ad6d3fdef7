//! Load of a leg from a piezoresistive cell, which saturates and has hysteresis, and a
//! piezoelectric one, which sees changes only: extended Kalman filters (chapter 4 of the thesis),
//! low-pass filters, and the identification of both cells. Measurements count at their own time
//! stamps: the estimate is that of all measurements in order of time, bit for bit, whatever the
//! order of their arrival. No function reads a clock, and a step allocates nothing.
//!
//! ```
//! use twinrig_estimate::{
//!     Channel, ForceEstimator, ForceResponse, Measurement, Model, Piezoresistive, Settings,
//!     StateSettings,
//! };
//!
//! let state = |variance, noise| StateSettings { initial: 0.0, variance, noise };
//! let mut estimator = ForceEstimator::new(&Settings {
//!     model: Model::F1 {
//!         gain: 0.02, // V·s/N
//!         states: [state(1.0, 1e-4), state(100.0, 0.1), state(0.01, 1e-8)],
//!     },
//!     piezoresistive: Some(Piezoresistive {
//!         response: ForceResponse::Linear { gain: 0.2, offset: 1.0 },
//!         variance: 1e-3,
//!     }),
//!     piezoelectric: Some(1e-3),
//!     frequency: None,
//!     period_s: 1e-3,
//!     white: 0.0,
//!     recovery: None,
//! })?;
//! for ms in 0..1000 {
//!     let force = 10.0 + 0.005 * f64::from(ms); // 5 N/s
//!     let at_ns = 1_000_000 * ms as u64;
//!     for (channel, value) in [
//!         (Channel::Piezoresistive, 0.2 * force + 1.0),
//!         (Channel::Piezoelectric, 0.02 * 5.0),
//!     ] {
//!         estimator.push(Measurement { at_ns, channel, value });
//!     }
//! }
//! let estimate = estimator.estimate();
//! assert!((estimate.force - 14.995).abs() < 0.01);
//! assert!((estimate.rate - 5.0).abs() < 0.5);
//! # Ok::<(), twinrig_estimate::EstimateError>(())
//! ```
//!
//! [`Model`] selects the filter: F1 and F2 are the thesis', F3 has the charge amplifier as states
//! and requires no frequency, F4 adds gain and creep. [`Settings::recovery`] returns an estimate
//! that is lost in saturation. [`Estimate`] has deviation, innovations and NIS;
//! [`ForceEstimator::nees`] compares with a known truth. [`Objective`] is that of tuning (eq. 4.19).
//!
//! # Limits
//!
//! - Measurement noises are white, Gaussian, constant and independent of each other. Residuals of
//!   real cells are not: expect NIS outside its band.
//! - The process is a chain of integrators: it knows no period, no contact and no sign of the
//!   force. Estimates below zero are possible.
//! - The process variances of states depend on how time is divided into steps, by terms of second
//!   order; white noise does not.
//! - Creep of the piezoresistive cell is a state of F4 only, temperature of none: elsewhere they
//!   appear as errors.
//! - Measurements older than the newest 64 are dropped.
//! - Identification assumes equally spaced samples for the amplifier, and forces known exactly.

mod amplifier;
mod butterworth;
mod calibration;
mod error;
mod estimate;
mod estimator;
pub mod fit;
mod kalman;
mod measurement;
mod model;
mod objective;
mod response;
mod settings;
mod track;

pub use amplifier::ChargeAmplifier;
pub use butterworth::{Butterworth, Section};
pub use calibration::Calibration;
pub use error::EstimateError;
pub use estimate::Estimate;
pub use estimator::ForceEstimator;
pub use kalman::{Innovation, Kalman};
pub use measurement::{Channel, Counters, Measurement, Outcome};
pub use model::{Decay, Model, StateSettings};
pub use objective::{Objective, TunedSample};
pub use response::{ForceResponse, Gradient, Hysteresis, Sigmoid};
pub use settings::{Piezoresistive, RECOVERY, Settings};
