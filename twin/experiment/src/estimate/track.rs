//! A filter over recorded signals.

use std::f64::consts::TAU;
use std::ops::Range;

use twinrig_estimate::{Channel, Estimate, EstimateError, ForceEstimator, Measurement, Settings};

use super::data::Signals;

/// Applies the samples in `range` to a new estimator, as the stage of a driver does, and passes
/// every index with its estimate and the estimator.
pub(crate) fn track(
    settings: &Settings,
    signals: &Signals,
    range: Range<usize>,
    mut each: impl FnMut(usize, &Estimate, &ForceEstimator),
) -> Result<(), EstimateError> {
    let mut estimator = ForceEstimator::new(settings)?;
    for i in range {
        let at_ns = signals.at_ns[i];
        let mut push = |channel, value| {
            estimator.push(Measurement {
                at_ns,
                channel,
                value,
            });
        };
        let [resistive, electric] = signals.saturated[i];
        if !resistive {
            push(Channel::Piezoresistive, signals.volts[0][i]);
        }
        if !electric {
            push(Channel::Piezoelectric, signals.volts[1][i]);
        }
        if let Some(hertz) = signals.frequency[i] {
            push(Channel::Frequency, TAU * hertz);
        }
        each(i, &estimator.estimate(), &estimator);
    }
    Ok(())
}
