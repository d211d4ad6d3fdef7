//! Units of claims of any kind.

use twinrig_kernel::Unit;

use crate::body::BodyClaim;
use crate::expect::{Claim, SignalMode};

impl Claim {
    /// Returns the unit of the measured value.
    pub(crate) fn unit(&self) -> Unit {
        match self {
            Claim::Footstep(claim) => claim.measure.unit(),
            Claim::Gait(claim) => claim.measure.unit(),
            Claim::Body(claim) => match claim {
                BodyClaim::Limited(measure, _) => measure.unit(),
                BodyClaim::Upright { .. } | BodyClaim::Settles { .. } => Unit::Meter,
                BodyClaim::Recovers(..) | BodyClaim::GetsUp(_) => Unit::Second,
            },
            Claim::Timing(claim) => claim.measure.unit(),
            Claim::Signal(claim) => match claim.mode {
                SignalMode::Recovers(..) => Unit::Second,
                _ => claim.unit,
            },
            Claim::Compare(claim) => claim.unit,
            Claim::Sequence(claim) => claim.other.unit,
            Claim::EnergyResidual(_) | Claim::Cost(..) => Unit::One,
        }
    }
}
