//! Statistics for one expectation of footsteps, updated footstep by footstep. Of the footsteps only
//! the last of each leg is stored, so the memory does not depend on the length of the run.

mod displacement;
mod mean;
mod order;
mod phase;
mod worst;

use super::footstep::Footstep;
use super::load_cycle::LoadCycle;
use super::outcome::{Finding, Verdict};
use super::touch_downs::TouchDown;
use super::tracker::{Window, seconds};
use crate::expect::{Axis, CycleMark, FootstepClaim, FootstepMeasure, LegChoice};
use crate::facts::LegFact;
use crate::limits::Limits;
use crate::pattern::Pattern;
use displacement::{CycleOfLeg, minus};
use mean::{Cycles, LoadMean, LoadSum, Mean};
use order::TouchDownOrder;
use phase::Phases;
use worst::Worst;

pub(super) use displacement::ReferenceStep;

/// Statistics of the footsteps of one expectation.
#[derive(Clone, Debug)]
pub(super) struct StepMeter {
    window: Window,
    /// Indices of the selected legs.
    legs: Vec<usize>,
    /// Number of touch-downs of each of them within the window.
    touch_down_counts: Vec<u64>,
    statistics: Statistics,
}

/// Statistics of a measure. Vectors have one element for each selected leg.
#[derive(Clone, Debug)]
enum Statistics {
    /// Value of each footstep.
    Each(Quantity, Limits, Vec<Worst>),
    /// Value of each pair of successive footsteps of a leg, and the last footsteps.
    Pairs(Pair, Limits, Vec<Worst>, Vec<Option<Footstep>>),
    /// Value of all footsteps of a leg.
    Mean(Mean, Limits, Vec<Cycles>),
    /// Value of all cycles of the load of a leg.
    LoadMean(LoadMean, Limits, Vec<LoadSum>),
    Phase {
        pattern: Pattern,
        tolerance: f64,
        phases: Option<Phases>,
    },
    PhaseSpread(Limits, Option<Phases>),
    Order(TouchDownOrder),
    Displacement(Axis, u32, Limits, Vec<CycleOfLeg>),
}

/// Quantity of a footstep.
#[derive(Clone, Copy, Debug)]
enum Quantity {
    Slip,
    Impulse,
    PeakLoad,
    Stance,
    Position(Axis),
}

/// Quantity of two successive footsteps.
#[derive(Clone, Copy, Debug)]
enum Pair {
    Swing,
    Stride,
}

/// Facts of the run besides its footsteps.
pub(super) struct RunFacts<'k> {
    pub legs: &'k [LegFact],
    /// Whether the robot fell within the window: a minimum that was not reached by then has not
    /// failed.
    pub fell: bool,
    /// Whether touch-downs were dropped from the order.
    pub overflowed: bool,
}

impl Quantity {
    /// Returns the value; none if the footstep has none.
    fn of(self, step: &Footstep) -> Option<f64> {
        match self {
            Quantity::Slip => Some(step.slip),
            Quantity::Impulse => step.lift_off.map(|_| step.impulse),
            Quantity::PeakLoad => Some(step.peak_load),
            Quantity::Stance => step.stance(),
            Quantity::Position(axis) => Some(axis.along(step.position)),
        }
    }
}

impl Pair {
    fn of(self, step: &Footstep, next: &Footstep) -> Option<f64> {
        match self {
            Pair::Swing => Some(seconds(next.touch_down - step.lift_off?)),
            Pair::Stride => Some(Axis::Horizontal.along(minus(next.position, step.position))),
        }
    }
}

impl Axis {
    fn along(self, v: [f64; 3]) -> f64 {
        match self {
            Axis::X => v[0],
            Axis::Y => v[1],
            Axis::Z => v[2],
            Axis::Horizontal => (v[0] * v[0] + v[1] * v[1]).sqrt(),
        }
    }
}

impl StepMeter {
    /// Creates the statistics of a claim in a scene with these legs.
    pub fn new(claim: &FootstepClaim, window: Window, all: &[LegFact]) -> Self {
        let legs = selected(&claim.legs, all);
        let count = legs.len();
        let each = |quantity, limits: &Limits| {
            Statistics::Each(quantity, *limits, vec![Worst::default(); count])
        };
        let pairs = |pair, limits: &Limits| {
            let worst = vec![Worst::default(); count];
            Statistics::Pairs(pair, *limits, worst, vec![None; count])
        };
        let mean =
            |mean, limits: &Limits| Statistics::Mean(mean, *limits, vec![Cycles::default(); count]);
        let load_mean = |mean, limits: &Limits| {
            Statistics::LoadMean(mean, *limits, vec![LoadSum::default(); count])
        };
        let statistics = match &claim.measure {
            FootstepMeasure::Slip(limits) => each(Quantity::Slip, limits),
            FootstepMeasure::SlipShare(limits) => mean(Mean::SlipShare, limits),
            FootstepMeasure::Impulse(limits) => each(Quantity::Impulse, limits),
            FootstepMeasure::PeakLoad(limits) => each(Quantity::PeakLoad, limits),
            FootstepMeasure::Position(axis, limits) => each(Quantity::Position(*axis), limits),
            FootstepMeasure::StanceTime(limits) => each(Quantity::Stance, limits),
            FootstepMeasure::SwingTime(limits) => pairs(Pair::Swing, limits),
            FootstepMeasure::StrideLength(limits) => pairs(Pair::Stride, limits),
            FootstepMeasure::DutyFactor(CycleMark::TouchDown, limits) => {
                mean(Mean::DutyFactor, limits)
            }
            FootstepMeasure::DutyFactor(CycleMark::Load, limits) => {
                load_mean(LoadMean::DutyFactor, limits)
            }
            FootstepMeasure::Contacts(limits) => load_mean(LoadMean::Contacts, limits),
            FootstepMeasure::Frequency(limits) => mean(Mean::Frequency, limits),
            FootstepMeasure::Count(limits) => mean(Mean::Count, limits),
            FootstepMeasure::Phase {
                by,
                pattern,
                tolerance,
            } => Statistics::Phase {
                pattern: pattern.clone(),
                tolerance: *tolerance,
                phases: Phases::new(*by, &legs),
            },
            FootstepMeasure::PhaseSpread(by, limits) => {
                Statistics::PhaseSpread(*limits, Phases::new(*by, &legs))
            }
            FootstepMeasure::Order(groups) => {
                let index = |name: &str| all.iter().position(|leg| leg.name == name);
                let group = groups.iter().map(|group| {
                    let legs = group.iter().filter_map(|leg| index(&leg.value));
                    legs.collect()
                });
                Statistics::Order(TouchDownOrder::new(group.collect()))
            }
            FootstepMeasure::Displacement {
                axis,
                cycle,
                limits,
            } => {
                let cycles = CycleOfLeg::new(*cycle, window.after, window.before);
                Statistics::Displacement(*axis, *cycle, *limits, vec![cycles; count])
            }
        };
        StepMeter {
            window,
            touch_down_counts: vec![0; count],
            legs,
            statistics,
        }
    }

    /// Returns the indices of the selected legs.
    pub fn legs(&self) -> &[usize] {
        &self.legs
    }

    /// Returns whether it evaluates cycles of the loads.
    pub fn reads_load_cycles(&self) -> bool {
        match &self.statistics {
            Statistics::LoadMean(..) => true,
            Statistics::Phase { phases, .. } | Statistics::PhaseSpread(_, phases) => {
                phases.as_ref().is_some_and(Phases::reads_load_cycles)
            }
            _ => false,
        }
    }

    /// Returns whether it refers to the run without changes.
    pub fn requires_reference(&self) -> bool {
        matches!(self.statistics, Statistics::Displacement(..))
    }

    /// Adds a completed footstep. Footsteps of a leg arrive in temporal order.
    pub fn step(&mut self, step: &Footstep) {
        let Some(place) = self.legs.iter().position(|leg| *leg == step.leg) else {
            return;
        };
        // The closest footstep to one of the reference run may be outside the window.
        if let Statistics::Displacement(_, _, _, cycles) = &mut self.statistics {
            cycles[place].add(step);
        }
        if !self.window.contains(step.touch_down) {
            return;
        }
        self.touch_down_counts[place] += 1;
        match &mut self.statistics {
            Statistics::Each(quantity, limits, worst) => {
                if let Some(value) = quantity.of(step) {
                    worst[place].add(step.touch_down, value, limits);
                }
            }
            Statistics::Pairs(pair, limits, worst, last) => {
                let last = last[place].replace(*step);
                let pair = last.and_then(|last| Some((last, pair.of(&last, step)?)));
                if let Some((last, value)) = pair {
                    worst[place].add(last.touch_down, value, limits);
                }
            }
            Statistics::Mean(_, _, cycles) => cycles[place].add(step),
            Statistics::LoadMean(..)
            | Statistics::Phase { .. }
            | Statistics::PhaseSpread(..)
            | Statistics::Order(_)
            | Statistics::Displacement(..) => {}
        }
    }

    /// Adds a cycle of the loads. It counts if all samples that it is measured by are in the
    /// window: those of one period before and after its centre.
    pub fn load_cycle(&mut self, cycle: &LoadCycle) {
        if !cycle.samples().iter().all(|at| self.window.contains(*at)) {
            return;
        }
        match &mut self.statistics {
            Statistics::LoadMean(mean, _, sums) => {
                for (leg, sum) in self.legs.iter().zip(sums) {
                    sum.add(*mean, &cycle.legs[*leg]);
                }
            }
            Statistics::Phase {
                phases: Some(phases),
                ..
            }
            | Statistics::PhaseSpread(_, Some(phases)) => phases.load_cycle(cycle),
            _ => {}
        }
    }

    /// Adds a touch-down. Touch-downs of all legs arrive in temporal order.
    pub fn touch_down(&mut self, touch_down: TouchDown) {
        if !self.window.contains(touch_down.at) {
            return;
        }
        match &mut self.statistics {
            Statistics::Phase {
                phases: Some(phases),
                ..
            }
            | Statistics::PhaseSpread(_, Some(phases)) => phases.touch_down(touch_down),
            Statistics::Order(order) => order.touch_down(touch_down),
            _ => {}
        }
    }

    /// Returns the reference footsteps of a displacement, leg by leg, if this is the run without
    /// changes.
    pub fn reference_steps(&self) -> Vec<Option<ReferenceStep>> {
        match &self.statistics {
            Statistics::Displacement(_, _, _, cycles) => {
                cycles.iter().map(CycleOfLeg::reference_step).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Sets the reference footsteps of the run without changes.
    pub fn set_reference(&mut self, reference_steps: &[Option<ReferenceStep>]) {
        if let Statistics::Displacement(_, _, _, cycles) = &mut self.statistics {
            for (cycle, reference_step) in cycles.iter_mut().zip(reference_steps) {
                cycle.set_reference(*reference_step);
            }
        }
    }

    /// Returns the finding. An observed violation counts even if another leg has no value.
    pub fn finding(&self, facts: &RunFacts<'_>) -> Finding {
        let name = |leg: usize| facts.legs[leg].name.as_str();
        let names = || self.legs.iter().map(|leg| name(*leg));
        let detail = |leg: usize| self.touch_down_detail(leg, name(leg));
        match &self.statistics {
            Statistics::Each(_, limits, worst) | Statistics::Pairs(_, limits, worst, _) => {
                let without_value = worst.iter().position(Worst::is_empty);
                let missing = without_value.map(|place| self.missing(place, facts));
                let legs = names().zip(worst.iter().copied());
                violation_or_missing(worst::finding(legs, limits), missing)
            }
            Statistics::Mean(mean, limits, cycles) => {
                let limits = match mean {
                    Mean::Count if facts.fell => maximum_only(limits),
                    _ => *limits,
                };
                let values = cycles.iter().map(|cycles| cycles.value(*mean));
                self.mean_finding(names().zip(values), &limits, facts)
            }
            Statistics::LoadMean(_, limits, sums) => {
                let values = sums.iter().map(LoadSum::value);
                self.mean_finding(names().zip(values), limits, facts)
            }
            Statistics::Phase { .. } | Statistics::PhaseSpread(..) | Statistics::Order(_)
                if facts.overflowed =>
            {
                Finding::unobserved("too many touch-downs to determine their order")
            }
            Statistics::Phase {
                pattern,
                tolerance,
                phases: Some(phases),
            } => {
                let (finding, missing) = phases.finding(facts.legs, pattern, *tolerance, &detail);
                violation_or_missing(finding, missing)
            }
            Statistics::PhaseSpread(limits, Some(phases)) => {
                let (finding, missing) = phases.spread(facts.legs, limits, &detail);
                violation_or_missing(finding, missing)
            }
            Statistics::Phase { .. } | Statistics::PhaseSpread(..) => {
                Finding::unobserved("a phase needs two legs")
            }
            Statistics::Order(order) => order.finding(facts.legs),
            Statistics::Displacement(axis, cycle, limits, cycles) => {
                let displacements = cycles.iter().map(|cycle| cycle.displacement(*axis, limits));
                let displacements: Vec<Worst> = displacements.collect();
                let missing = displacements.iter().any(Worst::is_empty).then(|| {
                    Finding::unobserved(format!(
                        "cycle {cycle} is missing here or in the run without changes"
                    ))
                });
                violation_or_missing(worst::finding(names().zip(displacements), limits), missing)
            }
        }
    }

    fn mean_finding<'n>(
        &self,
        legs: impl Iterator<Item = (&'n str, Option<f64>)>,
        limits: &Limits,
        facts: &RunFacts<'_>,
    ) -> Finding {
        let (finding, without_value) = mean::finding(legs, limits);
        let missing = without_value.map(|place| self.missing(place, facts));
        violation_or_missing(finding, missing)
    }

    fn missing(&self, place: usize, facts: &RunFacts<'_>) -> Finding {
        let leg = self.legs[place];
        Finding::unobserved(self.touch_down_detail(leg, &facts.legs[leg].name))
    }

    /// Returns the detail for a leg without a value.
    fn touch_down_detail(&self, leg: usize, name: &str) -> String {
        let place = self.legs.iter().position(|other| *other == leg);
        match place.map_or(0, |place| self.touch_down_counts[place]) {
            0 => format!("{name} never touched down"),
            1 => format!("{name} touched down once"),
            times => format!("{name} touched down {times} times"),
        }
    }
}

/// Returns the finding of the legs with values if it is a violation or if no leg lacks a value.
fn violation_or_missing(finding: Option<Finding>, missing: Option<Finding>) -> Finding {
    match (finding, missing) {
        (Some(finding), None) => finding,
        (Some(finding), Some(_)) if finding.verdict == Verdict::Fail => finding,
        (_, Some(missing)) => missing,
        (None, None) => Finding::unobserved("no footstep"),
    }
}

/// Returns the limits of a count that may still increase: only the maximum.
fn maximum_only(limits: &Limits) -> Limits {
    Limits {
        min: None,
        max: Some(limits.max.unwrap_or(f64::INFINITY)),
    }
}

fn selected(choice: &LegChoice, all: &[LegFact]) -> Vec<usize> {
    let selected = |leg: &LegFact| match choice {
        LegChoice::All => true,
        LegChoice::Fore => leg.fore,
        LegChoice::Hind => !leg.fore,
        LegChoice::Named(names) => names.iter().any(|name| name.value == leg.name),
    };
    let legs = all.iter().enumerate();
    let legs = legs.filter(|(_, leg)| selected(leg));
    legs.map(|(index, _)| index).collect()
}
