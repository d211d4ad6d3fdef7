//! The phases in which legs touch down.

use std::f64::consts::TAU;

use twinrig_kernel::SimTime;

use super::gait::Gait;
use super::outcome::Finding;
use crate::expect::Pattern;
use crate::limits::Limits;
use crate::scene::LegFact;

/// Mean and spread of the phase of one leg in the cycle of another.
struct LegPhase {
    leg: usize,
    /// Circular mean, as a share of the cycle.
    mean: f64,
    /// Circular standard deviation, as a share of the cycle.
    spread: f64,
}

/// Every leg's mean phase is the pattern's.
pub(super) fn finding(
    gait: &Gait<'_>,
    legs: &[usize],
    pattern: &Pattern,
    tolerance: f64,
) -> Finding {
    let phases = match phases(gait, legs) {
        Ok(phases) => phases,
        Err(finding) => return finding,
    };
    let Some(base) = legs
        .first()
        .and_then(|leg| share(pattern, &gait.legs[*leg]))
    else {
        return Finding::unobserved("the pattern does not say where the first leg is");
    };
    let mut worst = 0.0_f64;
    let mut detail = String::new();
    for phase in phases {
        let leg = &gait.legs[phase.leg];
        let Some(wanted) = share(pattern, leg) else {
            return Finding::unobserved(format!("the pattern does not say where {} is", leg.name));
        };
        let wanted = wrap(wanted - base);
        let off = wrap(phase.mean - wanted + 0.5) - 0.5;
        if off.abs() >= worst {
            worst = off.abs();
            let first = &gait.legs[legs[0]].name;
            detail = format!(
                "worst: {} at {:.3} of {first}'s cycle, wanted {wanted:.2}",
                leg.name, phase.mean
            );
        }
    }
    Finding::of(
        Limits::at_most(tolerance).compare(worst, worst),
        None,
        detail,
    )
}

/// How much every leg's phase varies.
pub(super) fn spread(gait: &Gait<'_>, legs: &[usize], limits: &Limits) -> Finding {
    let phases = match phases(gait, legs) {
        Ok(phases) => phases,
        Err(finding) => return finding,
    };
    let (mut least, mut greatest) = (f64::INFINITY, 0.0_f64);
    let mut detail = String::new();
    for phase in phases {
        least = least.min(phase.spread);
        if phase.spread >= greatest {
            greatest = phase.spread;
            detail = format!("worst: {}", gait.legs[phase.leg].name);
        }
    }
    Finding::of(limits.compare(least, greatest), None, detail)
}

/// The phase of every leg but the first in the first one's cycle, touch-down to touch-down.
fn phases(gait: &Gait<'_>, legs: &[usize]) -> Result<Vec<LegPhase>, Finding> {
    let [first, others @ ..] = legs else {
        return Err(Finding::unobserved("no leg"));
    };
    if others.is_empty() {
        return Err(Finding::unobserved("a phase needs two legs"));
    }
    let cycles: Vec<SimTime> = gait
        .of_leg(*first)
        .iter()
        .map(|step| step.touch_down)
        .collect();
    if cycles.len() < 3 {
        return Err(gait.no_footstep(*first));
    }
    others
        .iter()
        .map(|leg| phase(gait, *leg, &cycles))
        .collect()
}

fn phase(gait: &Gait<'_>, leg: usize, cycles: &[SimTime]) -> Result<LegPhase, Finding> {
    let (mut x, mut y, mut count) = (0.0, 0.0, 0_usize);
    for step in gait.of_leg(leg) {
        // The cycle that the touch-down falls into begins with the last reference touch-down not after it.
        let next = cycles.partition_point(|begin| *begin <= step.touch_down);
        if next == 0 || next == cycles.len() {
            continue;
        }
        let cycle = (cycles[next] - cycles[next - 1]).as_secs_f64();
        let share = (step.touch_down - cycles[next - 1]).as_secs_f64() / cycle;
        x += libm::cos(TAU * share);
        y += libm::sin(TAU * share);
        count += 1;
    }
    // A leg that is seen in less than half of the cycles has no phase in them.
    if 2 * count < cycles.len() - 1 {
        return Err(gait.no_footstep(leg));
    }
    let length = ((x * x + y * y).sqrt() / count as f64).min(1.0);
    Ok(LegPhase {
        leg,
        mean: wrap(libm::atan2(y, x) / TAU),
        spread: (-2.0 * libm::log(length)).max(0.0).sqrt() / TAU,
    })
}

/// The phase of a touch-down in a pattern, as a share of the cycle after that of the left fore leg.
fn share(pattern: &Pattern, leg: &LegFact) -> Option<f64> {
    Some(match (pattern, leg.fore, leg.left) {
        (Pattern::Given(legs), ..) => {
            let given = legs.iter().find(|(name, _)| name.value == leg.name);
            return given.map(|(_, share)| *share);
        }
        (Pattern::Trot, fore, left) if fore == left => 0.0,
        (Pattern::Pace, _, true) | (Pattern::Bound, true, _) | (Pattern::Walk, true, true) => 0.0,
        (Pattern::Walk, false, false) => 0.25,
        (Pattern::Walk, false, true) => 0.75,
        _ => 0.5,
    })
}

/// Into [0, 1).
fn wrap(share: f64) -> f64 {
    let wrapped = share - share.floor();
    if wrapped < 1.0 { wrapped } else { 0.0 }
}
