//! Expectations that depend on the traffic of buses.

use twinrig_kernel::signal::{BODY_POSITION, BODY_RPY};
use twinrig_runtime::BusSummary;

use super::Monitor;
use super::monitor::MonitorKind;
use super::outcome::{Finding, Verdict};
use crate::expect::{Claim, Expectation, SignalMode};
use crate::facts::LegFact;
use crate::glob::matches;
use crate::scene::{foot_load, foot_position};

/// Returns the number of deadlines that the buses of a claim about timing missed in its window.
pub(super) fn deadline_misses(
    expectation: &Expectation,
    monitor: &Monitor,
    buses: &[BusSummary],
) -> u64 {
    let window = monitor.window;
    let misses = of_timing(expectation, buses)
        .map(|bus| bus.health.deadline_misses(window.after, window.before));
    misses.sum()
}

/// Returns the buses of a claim about timing: all for one about the controller.
fn of_timing<'b>(
    expectation: &Expectation,
    buses: &'b [BusSummary],
) -> impl Iterator<Item = &'b BusSummary> {
    let of = match &expectation.claim {
        Claim::Timing(claim) => Some(claim.of.as_ref().map(|name| name.value.clone())),
        _ => None,
    };
    let concerns = move |bus: &&BusSummary| match &of {
        None => false,
        Some(None) => true,
        Some(Some(name)) => *name == bus.name,
    };
    buses.iter().filter(concerns)
}

/// Turns a pass into an unobserved finding where a bus did not provide what it is of: it was dead,
/// or a claim about timing is of a bus whose answers were not in time.
pub(super) fn restrict(
    finding: Finding,
    expectation: &Expectation,
    monitor: &Monitor,
    legs: &[LegFact],
    buses: &[BusSummary],
) -> Finding {
    if finding.verdict != Verdict::Pass || expectation.through_silence {
        return finding;
    }
    let window = monitor.window;
    let dead = buses.iter().find_map(|bus| {
        let silence = bus.health.dead(window.after, window.before)?;
        reads(expectation, bus, legs).then(|| format!("bus {}: {silence}", bus.name))
    });
    // A count has its bound for them.
    let is_counted =
        matches!(&monitor.meter, MonitorKind::Cycle(_, meter) if meter.counts_misses());
    let faulty = || {
        of_timing(expectation, buses).find_map(|bus| {
            let faults = bus.health.timing_faults(window.after, window.before);
            let name = &bus.name;
            (faults > 0 && !is_counted)
                .then(|| format!("{faults} answers and points of bus {name} were not in time"))
        })
    };
    dead.or_else(faulty).map_or(finding, Finding::unobserved)
}

/// Returns whether a claim is of signals that a bus provides, or of its timing.
fn reads(expectation: &Expectation, bus: &BusSummary, legs: &[LegFact]) -> bool {
    let provides = |name: &str| bus.signals.iter().any(|signal| matches(name, signal));
    match &expectation.claim {
        Claim::Signal(claim) => {
            let until = match &claim.mode {
                SignalMode::Until(_, until) => Some(&until.name.value),
                _ => None,
            };
            provides(&claim.name.value) || until.is_some_and(|name| provides(name))
        }
        Claim::Compare(claim) => {
            provides(&claim.signal.name.value) || provides(&claim.with.name.value)
        }
        Claim::Sequence(claim) => {
            provides(&claim.whenever.name.value) || provides(&claim.other.name.value)
        }
        Claim::Body(_) => provides(BODY_POSITION) || provides(BODY_RPY),
        Claim::Footstep(_) | Claim::Gait(_) => {
            let mut names = legs.iter().map(|leg| leg.name.as_str());
            names.any(|leg| provides(&foot_load(leg)) || provides(&foot_position(leg)))
        }
        Claim::Timing(claim) => claim.of.as_ref().is_none_or(|of| of.value == bus.name),
        Claim::EnergyResidual(_) | Claim::Cost(..) => false,
    }
}
