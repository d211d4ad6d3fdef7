//! Estimator of a leg's load from time-stamped measurements.

use serde::{Deserialize, Serialize};

use crate::error::EstimateError;
use crate::estimate::Estimate;
use crate::measurement::{Counters, Measurement, Outcome};
use crate::model::{AdaptiveModel, AmplifierModel, FrequencyModel, Model, RateModel};
use crate::settings::Settings;
use crate::track::{HISTORY, Track};

/// Extended Kalman filter with measurements in any order of arrival.
///
/// A late measurement is applied at its own time: the state before it is restored, and it and all
/// later ones are applied. The result is that of the measurements in order, bit for bit. The newest
/// [`ForceEstimator::HISTORY`] measurements are kept; what is older than all of them is dropped.
/// The initial state holds at the earliest measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceEstimator(Inner);

#[expect(
    clippy::large_enum_variant,
    reason = "a filter is created once, and a box would be a jump in every step"
)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Inner {
    F1(Track<RateModel, 3>),
    F2(Track<FrequencyModel, 5>),
    F3(Track<AmplifierModel, 6>),
    F4(Track<AdaptiveModel, 8>),
}

/// Evaluates an expression for the track of any model.
macro_rules! with {
    ($estimator:expr, $track:ident => $value:expr) => {
        match $estimator {
            Inner::F1($track) => $value,
            Inner::F2($track) => $value,
            Inner::F3($track) => $value,
            Inner::F4($track) => $value,
        }
    };
}

impl ForceEstimator {
    /// Number of measurements that are kept for late ones.
    pub const HISTORY: usize = HISTORY;

    /// Creates an estimator.
    ///
    /// # Errors
    /// [`EstimateError`] with the name of the first invalid entry; [`EstimateError::NoFrequency`]
    /// and [`EstimateError::NoSensor`].
    pub fn new(settings: &Settings) -> Result<Self, EstimateError> {
        settings.check()?;
        Ok(Self(match &settings.model {
            Model::F1 { gain, states } => {
                Inner::F1(Track::new(RateModel { gain: *gain }, states, settings))
            }
            Model::F2 {
                rate,
                acceleration,
                states,
            } => {
                let model = FrequencyModel {
                    rate: *rate,
                    acceleration: *acceleration,
                };
                Inner::F2(Track::new(model, states, settings))
            }
            Model::F3 { amplifier, states } => {
                let model = AmplifierModel {
                    amplifier: *amplifier,
                };
                Inner::F3(Track::new(model, states, settings))
            }
            Model::F4 {
                amplifier,
                floor,
                states,
            } => {
                let model = AdaptiveModel {
                    amplifier: *amplifier,
                    floor: *floor,
                };
                Inner::F4(Track::new(model, states, settings))
            }
        }))
    }

    /// Applies a measurement.
    pub fn push(&mut self, measurement: Measurement) -> Outcome {
        with!(&mut self.0, track => track.push(measurement))
    }

    /// Returns the estimate at the newest measurement; before the first, the initial state.
    pub fn estimate(&self) -> Estimate {
        with!(&self.0, track => track.estimate())
    }

    /// Returns the estimate at `at_ns` \[ns\] from the measurements up to then: later ones are not
    /// used. `None` if `at_ns` is before the history. Changes nothing.
    pub fn estimate_at(&self, at_ns: u64) -> Option<Estimate> {
        with!(&self.0, track => track.estimate_at(at_ns))
    }

    /// Returns the numbers of measurements by outcome.
    pub fn counters(&self) -> Counters {
        with!(&self.0, track => track.counters())
    }

    /// Returns the state at the newest measurement, in the order of [`Model::names`].
    pub fn state(&self) -> &[f64] {
        with!(&self.0, track => track.kalman().state().as_slice())
    }

    /// Returns the covariance at the newest measurement, row by row.
    pub fn covariance(&self) -> &[f64] {
        with!(&self.0, track => track.kalman().covariance().as_slice())
    }

    /// Returns the normalised estimation error squared at the newest measurement, for the first
    /// states: force, force and rate, or more. It is chi-squared with `truth.len()` degrees of
    /// freedom if the filter is consistent.
    ///
    /// # Errors
    /// [`EstimateError::Length`] and [`EstimateError::SingularCovariance`].
    pub fn nees(&self, truth: &[f64]) -> Result<f64, EstimateError> {
        with!(&self.0, track => track.kalman().nees(truth))
    }
}
