//! Claims about the trunk.

use twinrig_kernel::{SimDuration, SimTime, Unit};

use crate::language::Words;
use crate::limits::Limits;
use crate::recovery::{Recovery, TrunkQuantity};

/// A claim about the trunk.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyClaim {
    /// Measure within limits.
    Limited(BodyMeasure, Limits),
    /// Absence of a fall.
    Upright {
        /// Least height, as a share of the height in the first observation of the run.
        height: f64,
        /// Greatest roll or pitch, in magnitude \[rad\].
        tilt: f64,
        /// Whether a fall ends the run.
        end: bool,
    },
    /// Settling: from `by` to the end of the window each coordinate stays within `within` of its
    /// last value.
    Settles {
        /// \[m\]
        within: f64,
        /// Time since the start of the run.
        by: SimTime,
    },
    /// Recovery from a disturbance: quantities with their tolerances.
    Recovers(Recovery, Vec<(TrunkQuantity, f64)>),
    /// Rising from lying to standing.
    GetsUp(GetsUp),
}

/// Rising of the trunk: it lies where roll or pitch reach `lying`, and stands where neither exceeds
/// `tilt` and its height is `height` at least, without interruption for `hold`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GetsUp {
    /// Greatest time from the first instant at which it lies to that from which on it stands.
    pub within: SimDuration,
    /// \[rad\]
    pub lying: f64,
    /// \[rad\]
    pub tilt: f64,
    /// Share of the height in the first observation of the run.
    pub height: f64,
    /// Time for which it stands.
    pub hold: SimDuration,
}

/// Measure of the trunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyMeasure {
    /// Mean speed over the window \[m/s\].
    Speed(Along),
    /// Height of its centre of mass \[m\].
    Height,
    /// Greatest magnitude of the roll \[rad\].
    Roll,
    /// Greatest magnitude of the pitch \[rad\].
    Pitch,
    /// Peak-to-peak range of the roll \[rad\].
    RollRange,
    /// Peak-to-peak range of the pitch \[rad\].
    PitchRange,
    /// Peak-to-peak range of the height \[m\].
    HeightRange,
    /// Greatest magnitude of the change in heading since the start of the window, whole turns
    /// included \[rad\].
    YawDrift,
    /// Mean rate of the heading over the window, positive to the left, whole turns included
    /// \[rad/s\].
    TurnRate,
}

/// Definition of a travelled distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Displacement over the window along the heading at its start; negative if backward.
    Heading,
    /// Length of the path.
    Path,
    /// Motion along the present heading of the trunk; negative if backward.
    Forward,
    /// Motion to the left of the present heading; negative if to the right.
    Left,
}

impl Words for Along {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("heading", Along::Heading),
        ("path", Along::Path),
        ("forward", Along::Forward),
        ("left", Along::Left),
    ];
}

impl BodyMeasure {
    /// Returns the unit of the measured value.
    pub const fn unit(self) -> Unit {
        match self {
            BodyMeasure::Speed(_) => Unit::MeterPerSecond,
            BodyMeasure::Height | BodyMeasure::HeightRange => Unit::Meter,
            BodyMeasure::TurnRate => Unit::RadianPerSecond,
            BodyMeasure::Roll
            | BodyMeasure::Pitch
            | BodyMeasure::RollRange
            | BodyMeasure::PitchRange
            | BodyMeasure::YawDrift => Unit::Radian,
        }
    }

    /// Returns whether it is that of the fall after a fall.
    pub(crate) const fn requires_upright_robot(self) -> bool {
        match self {
            BodyMeasure::Speed(_)
            | BodyMeasure::RollRange
            | BodyMeasure::PitchRange
            | BodyMeasure::HeightRange
            | BodyMeasure::YawDrift
            | BodyMeasure::TurnRate => true,
            BodyMeasure::Height | BodyMeasure::Roll | BodyMeasure::Pitch => false,
        }
    }
}
