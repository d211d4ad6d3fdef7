//! Limits of claims of any kind.

use crate::body::BodyClaim;
use crate::expect::{Claim, FootstepMeasure, SignalMode};
use crate::limits::Limits;

impl Claim {
    /// Returns the limits of the measured value, where it has limits.
    pub(crate) fn limits(&self) -> Option<&Limits> {
        match self {
            Claim::Footstep(claim) => claim.measure.limits(),
            Claim::Gait(claim) => Some(&claim.limits),
            Claim::Body(claim) => match claim {
                BodyClaim::Limited(_, limits) => Some(limits),
                BodyClaim::Upright { .. }
                | BodyClaim::Settles { .. }
                | BodyClaim::Recovers(..)
                | BodyClaim::GetsUp(_) => None,
            },
            Claim::Timing(claim) => Some(&claim.limits),
            Claim::Signal(claim) => match &claim.mode {
                SignalMode::Always(limits)
                | SignalMode::Eventually(limits, _)
                | SignalMode::Until(limits, _) => Some(limits),
                SignalMode::Settles { .. } | SignalMode::Recovers(..) => None,
            },
            Claim::Compare(claim) => Some(&claim.limits),
            Claim::Sequence(claim) => Some(&claim.other.limits),
            Claim::EnergyResidual(limits) | Claim::Cost(_, limits) => Some(limits),
        }
    }
}

impl FootstepMeasure {
    /// Returns the limits, where it has limits.
    pub(crate) fn limits(&self) -> Option<&Limits> {
        match self {
            FootstepMeasure::Slip(limits)
            | FootstepMeasure::SlipShare(limits)
            | FootstepMeasure::DutyFactor(_, limits)
            | FootstepMeasure::Contacts(limits)
            | FootstepMeasure::StanceTime(limits)
            | FootstepMeasure::SwingTime(limits)
            | FootstepMeasure::Frequency(limits)
            | FootstepMeasure::StrideLength(limits)
            | FootstepMeasure::Impulse(limits)
            | FootstepMeasure::PeakLoad(limits)
            | FootstepMeasure::Position(_, limits)
            | FootstepMeasure::Count(limits)
            | FootstepMeasure::PhaseSpread(_, limits)
            | FootstepMeasure::Displacement { limits, .. } => Some(limits),
            FootstepMeasure::Phase { .. } | FootstepMeasure::Order(_) => None,
        }
    }
}
