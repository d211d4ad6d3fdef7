//! Warnings about exact expectations past the predictability horizon.

use twinrig_document::Item;
use twinrig_kernel::{SimDuration, SimTime};

use crate::expect::{Claim, Expectation, FootstepMeasure};
use crate::limits::Limits;
use crate::read::{code, print_duration};

/// Width of limits, over the greater of their magnitudes, up to which they are exact.
const NARROW: f64 = 2e-3;

/// Warns about the expectation in the table `item` if it is exact, and is judged later than
/// `horizon` in a run of duration `run`.
pub(super) fn warn(
    item: &Item<'_>,
    expectation: &Expectation,
    horizon: SimDuration,
    run: SimDuration,
) {
    let Some(reason) = exactness(&expectation.claim) else {
        return;
    };
    let until = match &expectation.claim {
        // Of a footstep soon after the start of the window.
        claim if is_displacement(claim) => expectation.after,
        _ => expectation.before.unwrap_or(SimTime::ZERO + run),
    };
    if until <= SimTime::ZERO + horizon {
        return;
    }
    let message = format!(
        "it is exact, {reason}, and judged past the predictability horizon, {}",
        print_duration(horizon)
    );
    let help = "past the horizon rounding decides: end the window earlier by `before`, or accept \
                a wider range";
    item.warn(code::EXACT, message, help);
}

fn is_displacement(claim: &Claim) -> bool {
    let Claim::Footstep(claim) = claim else {
        return false;
    };
    matches!(claim.measure, FootstepMeasure::Displacement { .. })
}

/// Returns the reason for which a claim about a trajectory is exact; none if it is not.
fn exactness(claim: &Claim) -> Option<&'static str> {
    if is_displacement(claim) {
        return Some("a comparison with a footstep of another run");
    }
    let Limits { min, max } = claim.limits()?;
    let (min, max) = ((*min)?, (*max)?);
    if is_count(claim) {
        return (max.floor() <= min.ceil()).then_some("one number alone");
    }
    let is_narrow = max - min <= NARROW * min.abs().max(max.abs());
    is_narrow.then_some("with limits a five-hundredth of their value apart, or less")
}

fn is_count(claim: &Claim) -> bool {
    let Claim::Footstep(claim) = claim else {
        return false;
    };
    matches!(claim.measure, FootstepMeasure::Count(_))
}
