//! Classes of gaits: phases of the legs in each cycle against patterns.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::gait::run::{GaitRun, MeasuredCycle, PhaseSample};

/// Phase of each leg, as a share of a cycle.
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
/// Greatest distance of two cycles without a gap between them, in periods.
const GAP: f64 = 1.5;

/// One cycle of the loads, a time of standing, or one in which the loads do not repeat.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GaitCycle {
    /// Begin \[s\].
    pub begin_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// Name of the nearest pattern, [`MIXED`] or [`STANDING`].
    pub class: String,
    /// The same by the phases of the oscillators; none without them, or outside of a cycle.
    pub oscillators: Option<String>,
    /// Phases of the oscillators, so that an oscillator that is ahead has the phase of a leg that
    /// touches down earlier; empty likewise.
    pub oscillator_phases: Vec<f64>,
    /// Greatest deviation of a leg from the nearest pattern, as a share of the cycle; none if a leg
    /// has no phase.
    pub deviation: Option<f64>,
    /// Phases of all legs by their loads; empty likewise.
    pub phases: Vec<f64>,
    /// Mean number of contacts of a leg, bounces included; none outside of a cycle.
    pub contacts: Option<f64>,
    /// Value of the variable at the begin.
    pub value: f64,
    /// Path of the feet on the ground in this time \[m\].
    pub slip_m: f64,
}

impl GaitCycle {
    fn without_phases([begin_s, end_s]: [f64; 2], class: &str) -> Self {
        GaitCycle {
            begin_s,
            end_s,
            class: class.to_owned(),
            oscillators: None,
            oscillator_phases: Vec::new(),
            deviation: None,
            phases: Vec::new(),
            contacts: None,
            value: 0.0,
            slip_m: 0.0,
        }
    }
}

/// Returns the cycles of a run, and the times without them, in order.
pub(crate) fn cycles(run: &GaitRun, patterns: &[GaitPattern], tolerance: f64) -> Vec<GaitCycle> {
    let end_s = run.fell_at_s.unwrap_or(run.end_s);
    let standing = standing(run, end_s);
    let stands = |at_s: f64| {
        let mut standing = standing.iter();
        standing.any(|&[from, to]| from < at_s && at_s < to)
    };
    let patterns = Patterns {
        patterns,
        tolerance,
    };
    let cycles = run.cycles.iter().zip(spans(&run.cycles));
    let cycles = cycles.filter(|(cycle, _)| cycle.centre_s < end_s && !stands(cycle.centre_s));
    let mut found: Vec<GaitCycle> = cycles
        .map(|(cycle, span)| patterns.classified(cycle, span, &run.oscillators))
        .collect();
    let standing = standing.iter();
    found.extend(standing.map(|span| GaitCycle::without_phases(*span, STANDING)));
    found.sort_by(|a, b| a.begin_s.total_cmp(&b.begin_s));
    // Standing is from the end of the last cycle before it to the begin of the next one.
    for place in 0..found.len() {
        if found[place].class == STANDING {
            let last_s = place.checked_sub(1).map(|last| found[last].end_s);
            let next_s = found.get(place + 1).map(|next| next.begin_s);
            let standing = &mut found[place];
            standing.begin_s = standing.begin_s.max(last_s.unwrap_or(0.0));
            standing.end_s = standing.end_s.min(next_s.unwrap_or(end_s));
        }
    }
    let mut all = Vec::with_capacity(found.len());
    let mut until_s = 0.0;
    for cycle in found {
        if cycle.begin_s > until_s {
            all.push(GaitCycle::without_phases([until_s, cycle.begin_s], MIXED));
        }
        until_s = cycle.end_s;
        all.push(cycle);
    }
    if end_s > until_s {
        all.push(GaitCycle::without_phases([until_s, end_s], MIXED));
    }
    for cycle in &mut all {
        cycle.slip_m = run.slip_m([cycle.begin_s, cycle.end_s]);
    }
    all
}

/// Returns the times without a touch-down of any leg.
fn standing(run: &GaitRun, end_s: f64) -> Vec<[f64; 2]> {
    let touch_downs = run.footsteps.iter().map(|step| step.touch_down_s);
    let touch_downs = touch_downs.filter(|at_s| *at_s < end_s);
    let mut instants: Vec<f64> = touch_downs.chain([0.0, end_s]).collect();
    instants.sort_by(f64::total_cmp);
    let pairs = instants.windows(2).map(|pair| [pair[0], pair[1]]);
    pairs.filter(|[from, to]| to - from >= STANDING_S).collect()
}

/// Returns begin and end of each cycle: half a period from its centre, or half way to the next one.
fn spans(cycles: &[MeasuredCycle]) -> Vec<[f64; 2]> {
    let own = |cycle: &MeasuredCycle| {
        let half_s = 0.5 * cycle.period_s;
        [cycle.centre_s - half_s, cycle.centre_s + half_s]
    };
    let mut spans: Vec<[f64; 2]> = cycles.iter().map(own).collect();
    for (place, pair) in cycles.windows(2).enumerate() {
        let apart_s = pair[1].centre_s - pair[0].centre_s;
        if apart_s < GAP * pair[0].period_s.max(pair[1].period_s) {
            let middle_s = f64::midpoint(pair[0].centre_s, pair[1].centre_s);
            (spans[place][1], spans[place + 1][0]) = (middle_s, middle_s);
        }
    }
    spans
}

/// Patterns, and the greatest deviation from them.
struct Patterns<'p> {
    patterns: &'p [GaitPattern],
    tolerance: f64,
}

impl Patterns<'_> {
    fn classified(
        &self,
        cycle: &MeasuredCycle,
        span: [f64; 2],
        oscillators: &[PhaseSample],
    ) -> GaitCycle {
        let phases: Option<Vec<f64>> = cycle.phases.iter().copied().collect();
        let oscillators = mean_phases(oscillators, span);
        let (class, deviation) = self.nearest(phases.as_deref());
        let legs = cycle.contacts.len().max(1);
        GaitCycle {
            oscillators: oscillators
                .as_ref()
                .map(|phases| self.nearest(Some(phases)).0.to_owned()),
            oscillator_phases: oscillators.unwrap_or_default(),
            deviation,
            phases: phases.unwrap_or_default(),
            contacts: Some(cycle.contacts.iter().sum::<f64>() / legs as f64),
            ..GaitCycle::without_phases(span, class)
        }
    }

    /// Returns the class of phases, and their deviation from the nearest pattern.
    fn nearest(&self, phases: Option<&[f64]>) -> (&str, Option<f64>) {
        let nearest = phases.and_then(|phases| {
            let deviations = self.patterns.iter();
            let deviations =
                deviations.map(|pattern| (deviation(phases, &pattern.phases), pattern));
            deviations.min_by(|(a, _), (b, _)| a.total_cmp(b))
        });
        let class = nearest.filter(|(deviation, _)| *deviation <= self.tolerance);
        let class = class.map_or(MIXED, |(_, pattern)| &pattern.name);
        (class, nearest.map(|(deviation, _)| deviation))
    }
}

/// Returns the circular mean of each oscillator's phase after that of the first in a span, as a
/// share of the cycle. An oscillator that is ahead brings its leg to the ground earlier.
fn mean_phases(samples: &[PhaseSample], [from_s, to_s]: [f64; 2]) -> Option<Vec<f64>> {
    let from = samples.partition_point(|sample| sample.at_s < from_s);
    let to = samples.partition_point(|sample| sample.at_s < to_s);
    let within = samples.get(from..to).filter(|within| !within.is_empty())?;
    let mean = |leg: usize| {
        let turns = within.iter().map(|sample| {
            let ahead = sample.phases_rad[leg] - sample.phases_rad[0];
            libm::sincos(ahead)
        });
        let (y, x) = turns.fold((0.0, 0.0), |(y, x), turn| (y + turn.0, x + turn.1));
        wrap(-libm::atan2(y, x) / TAU)
    };
    Some((0..within[0].phases_rad.len()).map(mean).collect())
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
