//! Classes of gaits: each cycle of the first leg against patterns of touch-downs.

use serde::Serialize;

use crate::gait_run::{FootContact, GaitRun};

/// Phase of the touch-down of each leg, as a share of a cycle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GaitPattern {
    /// Name; a pattern and its mirror image may have the same.
    pub name: String,
    /// Phases, in the order of the legs; only differences count.
    pub phases: Vec<f64>,
}

/// Class of a cycle that is near no pattern.
pub const MIXED: &str = "mixed";
/// Class of a time without touch-downs.
pub const STANDING: &str = "standing";

/// Least time without a touch-down of any leg that is standing \[s\]: above half the period of a
/// trot at 0.25 Hz, the slowest step of figure 3.7.
const STANDING_S: f64 = 3.0;
/// Part of a cycle by which a touch-down may be outside of it: legs in phase with the first one
/// touch down before or after it.
const MARGIN: f64 = 0.25;
/// Touch-downs of a leg closer than this part of a cycle are not one for each cycle.
const LEAST_APART: f64 = 0.7;

/// One cycle of the first leg, or a time of standing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GaitCycle {
    /// Touch-down of the first leg, or begin of the standing \[s\].
    pub begin_s: f64,
    /// Next touch-down, or end of the standing \[s\].
    pub end_s: f64,
    /// Name of the nearest pattern, [`MIXED`] or [`STANDING`].
    pub class: String,
    /// Greatest deviation of a leg from the nearest pattern, as a share of the cycle; none if a leg
    /// does not touch down once.
    pub deviation: Option<f64>,
    /// Phases of all legs; empty likewise.
    pub phases: Vec<f64>,
    /// Value of the variable at the begin.
    pub value: f64,
    /// Path of the feet on the ground in this time \[m\].
    pub slip_m: f64,
}

/// Returns the cycles of a run and the times of standing, in order.
pub(crate) fn cycles(run: &GaitRun, patterns: &[GaitPattern], tolerance: f64) -> Vec<GaitCycle> {
    let legs: Vec<Vec<FootContact>> = (0..run.legs.len())
        .map(|leg| run.footsteps_of(leg))
        .collect();
    let end_s = run.fell_at_s.unwrap_or(run.end_s);
    let standing = standing(&legs, end_s);
    let Some((first, others)) = legs.split_first() else {
        return Vec::new();
    };
    let mut found: Vec<GaitCycle> = first
        .windows(2)
        .map(|pair| [pair[0].touch_down_s, pair[1].touch_down_s])
        .filter(|&[begin, end]| !standing.iter().any(|&[from, to]| from < end && begin < to))
        .map(|span| classified(span, others, patterns, tolerance))
        .collect();
    found.extend(standing.into_iter().map(|[begin_s, end_s]| GaitCycle {
        begin_s,
        end_s,
        class: STANDING.to_owned(),
        deviation: None,
        phases: Vec::new(),
        value: 0.0,
        slip_m: 0.0,
    }));
    found.sort_by(|a, b| a.begin_s.total_cmp(&b.begin_s));
    for cycle in &mut found {
        cycle.slip_m = run.slip_m([cycle.begin_s, cycle.end_s]);
    }
    found
}

/// Returns the times without a touch-down of any leg.
fn standing(legs: &[Vec<FootContact>], end_s: f64) -> Vec<[f64; 2]> {
    let touch_downs = legs.iter().flatten().map(|step| step.touch_down_s);
    let mut instants: Vec<f64> = touch_downs.chain([0.0, end_s]).collect();
    instants.sort_by(f64::total_cmp);
    let pairs = instants.windows(2).map(|pair| [pair[0], pair[1]]);
    pairs.filter(|[from, to]| to - from >= STANDING_S).collect()
}

fn classified(
    [begin_s, end_s]: [f64; 2],
    others: &[Vec<FootContact>],
    patterns: &[GaitPattern],
    tolerance: f64,
) -> GaitCycle {
    let others = others.iter().map(|steps| phase(steps, [begin_s, end_s]));
    let phases: Option<Vec<f64>> = std::iter::once(Some(0.0)).chain(others).collect();
    let nearest = phases.as_ref().and_then(|phases| {
        let deviations = patterns
            .iter()
            .map(|pattern| (deviation(phases, &pattern.phases), pattern));
        deviations.min_by(|(a, _), (b, _)| a.total_cmp(b))
    });
    let class = nearest.filter(|(deviation, _)| *deviation <= tolerance);
    GaitCycle {
        begin_s,
        end_s,
        class: class.map_or(MIXED, |(_, pattern)| &pattern.name).to_owned(),
        deviation: nearest.map(|(deviation, _)| deviation),
        phases: phases.unwrap_or_default(),
        value: 0.0,
        slip_m: 0.0,
    }
}

/// Returns the phase of a leg in a cycle; none unless it touches down once for each cycle.
fn phase(steps: &[FootContact], [begin_s, end_s]: [f64; 2]) -> Option<f64> {
    let period_s = end_s - begin_s;
    let shares = steps
        .iter()
        .map(|step| (step.touch_down_s - begin_s) / period_s);
    let shares: Vec<f64> = shares
        .filter(|share| (-MARGIN..1.0 + MARGIN).contains(share))
        .collect();
    let inside = shares.iter().filter(|share| (0.0..1.0).contains(*share));
    let inside: Vec<f64> = inside.copied().collect();
    match inside[..] {
        [share] => Some(share),
        // A leg in phase with the first one: at the begin and at the end, or outside of both.
        [first, last] if last - first >= LEAST_APART => Some(first),
        [] => shares.first().map(|share| wrap(*share)),
        _ => None,
    }
}

/// Returns the greatest deviation of a leg from a pattern that is rotated to fit best: half of the
/// shortest arc that contains all differences.
pub(crate) fn deviation(phases: &[f64], pattern: &[f64]) -> f64 {
    if phases.len() != pattern.len() || phases.is_empty() {
        return f64::INFINITY;
    }
    let differences = phases.iter().zip(pattern);
    let mut differences: Vec<f64> = differences.map(|(a, b)| wrap(a - b)).collect();
    differences.sort_by(f64::total_cmp);
    let last = differences[differences.len() - 1];
    let around = 1.0 - (last - differences[0]);
    let gaps = differences.windows(2).map(|pair| pair[1] - pair[0]);
    let widest = gaps.fold(around, f64::max);
    0.5 * (1.0 - widest)
}

/// Wraps a phase into [0, 1).
fn wrap(share: f64) -> f64 {
    let wrapped = share - libm::floor(share);
    if wrapped < 1.0 { wrapped } else { 0.0 }
}
