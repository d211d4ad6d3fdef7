//! Claims that compare a signal with another.

use twinrig_document::Placed;
use twinrig_kernel::{SimDuration, Unit};

use crate::domain::Domain;
use crate::limits::Limits;

/// A claim about a signal compared with another, which has the same unit.
///
/// They are compared at the samples of the signal. Where the other one is sampled at other instants
/// (a signal of the plant beside one of the controller), it is interpolated linearly between its
/// samples.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareClaim {
    /// The signal: an estimate, a measurement.
    pub signal: Operand,
    /// The signal that it is compared with: the truth.
    pub with: Operand,
    /// Measure.
    pub measure: CompareMeasure,
    /// Unit of its limits.
    pub unit: Unit,
    /// Its limits.
    pub limits: Limits,
}

/// An element of a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Operand {
    /// Name.
    pub name: Placed<String>,
    /// Element; none for the only one.
    pub component: Option<usize>,
}

/// Measure of a comparison of two signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareMeasure {
    /// Root mean square of the difference, in the unit of the signals.
    Error,
    /// Greatest magnitude of the difference, in the unit of the signals.
    ErrorPeak,
    /// Time by which the signal lags the other one \[s\]: the maximum of the cross-correlation
    /// (Pearson's coefficient at each lag), refined by a parabola.
    ///
    /// The grid of lags is the period of the samples, or 1/128 of the range if that is longer. For
    /// a sine of angular frequency ω on a grid of h the parabola errs by at most 0.016 (ω h)² h (ω
    /// h well below 1). Every lag is judged by the same part of the signal, from `range` after its
    /// start to `range` before its end; an incomplete period in it biases the delay. Among maxima
    /// that differ by less than 0.001, as those of a periodic signal, the one with the least delay
    /// counts.
    Delay {
        /// Greatest delay, either way.
        range: SimDuration,
    },
    /// Pearson's coefficient of correlation at zero lag \[1\].
    Correlation,
    /// Slope of the linear regression of the signal on the other one \[1\].
    Gain,
    /// Mean of the signal's maxima over the mean of the other one's maxima \[1\]: one of each in
    /// every period of the latter, which begins where it crosses the middle of its range upwards.
    Peaks,
}

impl CompareMeasure {
    /// Returns the possible values.
    pub(crate) const fn domain(self) -> Domain {
        match self {
            CompareMeasure::Error | CompareMeasure::ErrorPeak => Domain::NOT_NEGATIVE,
            CompareMeasure::Correlation => Domain::CORRELATION,
            CompareMeasure::Delay { .. } | CompareMeasure::Gain | CompareMeasure::Peaks => {
                Domain::ANY
            }
        }
    }

    /// Returns the unit of the measured value; none for that of the signals.
    pub const fn unit(self) -> Option<Unit> {
        match self {
            CompareMeasure::Error | CompareMeasure::ErrorPeak => None,
            CompareMeasure::Delay { .. } => Some(Unit::Second),
            CompareMeasure::Correlation | CompareMeasure::Gain | CompareMeasure::Peaks => {
                Some(Unit::One)
            }
        }
    }
}
