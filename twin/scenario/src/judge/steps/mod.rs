//! One expectation of footsteps, fed footstep by footstep. It keeps statistics and no footsteps but
//! the last of each leg, so a run may be as long as it likes.

mod displacement;
mod mean;
mod order;
mod phase;
mod worst;

use super::footstep::Footstep;
use super::outcome::{Finding, Verdict};
use super::touch_downs::TouchDown;
use super::tracker::{Window, seconds};
use crate::expect::{Axis, FootstepClaim, FootstepMeasure, LegChoice, Pattern};
use crate::limits::Limits;
use crate::scene::LegFact;
use displacement::{CycleOfLeg, minus};
use mean::{Cycles, Mean};
use order::Turns;
use phase::Phases;
use worst::Worst;

pub(super) use displacement::Counterpart;

/// Watches the footsteps of one expectation.
#[derive(Clone, Debug)]
pub(super) struct StepMeter {
    window: Window,
    /// Whose footsteps, by index.
    legs: Vec<usize>,
    /// How many touch-downs each of them had within the window.
    touched: Vec<u64>,
    statistics: Statistics,
}

/// What is kept. Vectors have a place for each leg that is watched.
#[derive(Clone, Debug)]
enum Statistics {
    /// A number of every footstep.
    Each(Number, Limits, Vec<Worst>),
    /// A number of every footstep and the next one of its leg, and the last footsteps.
    Between(Pair, Limits, Vec<Worst>, Vec<Option<Footstep>>),
    /// A number of all footsteps of a leg.
    Mean(Mean, Limits, Vec<Cycles>),
    Phase {
        pattern: Pattern,
        tolerance: f64,
        phases: Option<Phases>,
    },
    PhaseSpread(Limits, Option<Phases>),
    Order(Turns),
    Displacement(Axis, u32, Limits, Vec<CycleOfLeg>),
}

/// A number of a footstep.
#[derive(Clone, Copy, Debug)]
enum Number {
    Slip,
    Impulse,
    PeakLoad,
    Stance,
    Position(Axis),
}

/// A number of two footsteps.
#[derive(Clone, Copy, Debug)]
enum Pair {
    Swing,
    Stride,
}

/// What is known beside the footsteps.
pub(super) struct Known<'k> {
    pub legs: &'k [LegFact],
    /// Whether the robot fell within the window: what is not reached yet has not failed then.
    pub fell: bool,
    /// Whether the order of touch-downs is lost.
    pub lost: bool,
}

impl Number {
    /// None if the footstep has none.
    fn of(self, step: &Footstep) -> Option<f64> {
        match self {
            Number::Slip => Some(step.slip),
            Number::Impulse => step.lift_off.map(|_| step.impulse),
            Number::PeakLoad => Some(step.peak_load),
            Number::Stance => step.stance(),
            Number::Position(axis) => Some(axis.along(step.position)),
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
    /// Of the claim, in a scene of these legs.
    pub fn new(claim: &FootstepClaim, window: Window, all: &[LegFact]) -> Self {
        let legs = chosen(&claim.legs, all);
        let count = legs.len();
        let each = |number, limits: &Limits| {
            Statistics::Each(number, *limits, vec![Worst::default(); count])
        };
        let between = |pair, limits: &Limits| {
            let worst = vec![Worst::default(); count];
            Statistics::Between(pair, *limits, worst, vec![None; count])
        };
        let mean =
            |mean, limits: &Limits| Statistics::Mean(mean, *limits, vec![Cycles::default(); count]);
        let statistics = match &claim.measure {
            FootstepMeasure::Slip(limits) => each(Number::Slip, limits),
            FootstepMeasure::Impulse(limits) => each(Number::Impulse, limits),
            FootstepMeasure::PeakLoad(limits) => each(Number::PeakLoad, limits),
            FootstepMeasure::Position(axis, limits) => each(Number::Position(*axis), limits),
            FootstepMeasure::StanceTime(limits) => each(Number::Stance, limits),
            FootstepMeasure::SwingTime(limits) => between(Pair::Swing, limits),
            FootstepMeasure::StrideLength(limits) => between(Pair::Stride, limits),
            FootstepMeasure::DutyFactor(limits) => mean(Mean::DutyFactor, limits),
            FootstepMeasure::Frequency(limits) => mean(Mean::Frequency, limits),
            FootstepMeasure::Count(limits) => mean(Mean::Count, limits),
            FootstepMeasure::Phase { pattern, tolerance } => Statistics::Phase {
                pattern: pattern.clone(),
                tolerance: *tolerance,
                phases: Phases::new(&legs),
            },
            FootstepMeasure::PhaseSpread(limits) => {
                Statistics::PhaseSpread(*limits, Phases::new(&legs))
            }
            FootstepMeasure::Order(groups) => {
                let index = |name: &str| all.iter().position(|leg| leg.name == name);
                let group = groups.iter().map(|group| {
                    let legs = group.iter().filter_map(|leg| index(&leg.value));
                    legs.collect()
                });
                Statistics::Order(Turns::new(group.collect()))
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
            touched: vec![0; count],
            legs,
            statistics,
        }
    }

    /// Whose footsteps.
    pub fn legs(&self) -> &[usize] {
        &self.legs
    }

    /// Whether it is against the run without changes.
    pub fn wants_a_reference(&self) -> bool {
        matches!(self.statistics, Statistics::Displacement(..))
    }

    /// Takes a footstep that is closed. Those of a leg come in the order of time.
    pub fn step(&mut self, step: &Footstep) {
        let Some(place) = self.legs.iter().position(|leg| *leg == step.leg) else {
            return;
        };
        // A footstep of the other run may be nearest to one outside the window.
        if let Statistics::Displacement(_, _, _, cycles) = &mut self.statistics {
            cycles[place].add(step);
        }
        if !self.window.contains(step.touch_down) {
            return;
        }
        self.touched[place] += 1;
        match &mut self.statistics {
            Statistics::Each(number, limits, worst) => {
                if let Some(value) = number.of(step) {
                    worst[place].add(step.touch_down, value, limits);
                }
            }
            Statistics::Between(pair, limits, worst, last) => {
                let last = last[place].replace(*step);
                let pair = last.and_then(|last| Some((last, pair.of(&last, step)?)));
                if let Some((last, value)) = pair {
                    worst[place].add(last.touch_down, value, limits);
                }
            }
            Statistics::Mean(_, _, cycles) => cycles[place].add(step),
            Statistics::Phase { .. }
            | Statistics::PhaseSpread(..)
            | Statistics::Order(_)
            | Statistics::Displacement(..) => {}
        }
    }

    /// Takes a touch-down. Those of all legs come in the order of time.
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
            Statistics::Order(turns) => turns.touch_down(touch_down),
            _ => {}
        }
    }

    /// The footsteps of the run without changes that a displacement is against, leg by leg, if this
    /// is that run.
    pub fn counterparts(&self) -> Vec<Option<Counterpart>> {
        match &self.statistics {
            Statistics::Displacement(_, _, _, cycles) => {
                cycles.iter().map(CycleOfLeg::counterpart).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Compares with those of the run without changes from now on.
    pub fn compare_with(&mut self, counterparts: &[Option<Counterpart>]) {
        if let Statistics::Displacement(_, _, _, cycles) = &mut self.statistics {
            for (cycle, counterpart) in cycles.iter_mut().zip(counterparts) {
                cycle.compare_with(*counterpart);
            }
        }
    }

    /// The finding. A violation that was seen counts even where another leg has no number.
    pub fn finding(&self, known: &Known<'_>) -> Finding {
        let name = |leg: usize| known.legs[leg].name.as_str();
        let names = || self.legs.iter().map(|leg| name(*leg));
        let touched = |leg: usize| self.touched_down(leg, name(leg));
        match &self.statistics {
            Statistics::Each(_, limits, worst) | Statistics::Between(_, limits, worst, _) => {
                let without = worst.iter().position(Worst::is_empty);
                let missing = without.map(|place| self.missing(place, known));
                let legs = names().zip(worst.iter().copied());
                either(worst::finding(legs, limits), missing)
            }
            Statistics::Mean(mean, limits, cycles) => {
                let limits = match mean {
                    Mean::Count if known.fell => not_below(limits),
                    _ => *limits,
                };
                let legs = names().zip(cycles.iter().copied());
                let (finding, without) = mean::finding(legs, *mean, &limits);
                either(finding, without.map(|place| self.missing(place, known)))
            }
            Statistics::Phase { .. } | Statistics::PhaseSpread(..) | Statistics::Order(_)
                if known.lost =>
            {
                Finding::unobserved("too many touch-downs to tell their order")
            }
            Statistics::Phase {
                pattern,
                tolerance,
                phases: Some(phases),
            } => {
                let (finding, missing) = phases.finding(known.legs, pattern, *tolerance, &touched);
                either(finding, missing)
            }
            Statistics::PhaseSpread(limits, Some(phases)) => {
                let (finding, missing) = phases.spread(known.legs, limits, &touched);
                either(finding, missing)
            }
            Statistics::Phase { .. } | Statistics::PhaseSpread(..) => {
                Finding::unobserved("a phase needs two legs")
            }
            Statistics::Order(turns) => turns.finding(),
            Statistics::Displacement(axis, cycle, limits, cycles) => {
                let moved = cycles.iter().map(|cycle| cycle.moved(*axis, limits));
                let moved: Vec<Worst> = moved.collect();
                let missing = moved.iter().any(Worst::is_empty).then(|| {
                    Finding::unobserved(format!(
                        "cycle {cycle} is missing here or in the run without changes"
                    ))
                });
                either(worst::finding(names().zip(moved), limits), missing)
            }
        }
    }

    fn missing(&self, place: usize, known: &Known<'_>) -> Finding {
        let leg = self.legs[place];
        Finding::unobserved(self.touched_down(leg, &known.legs[leg].name))
    }

    /// What is said about a leg that has no number.
    fn touched_down(&self, leg: usize, name: &str) -> String {
        let place = self.legs.iter().position(|other| *other == leg);
        match place.map_or(0, |place| self.touched[place]) {
            0 => format!("{name} never touched down"),
            1 => format!("{name} touched down once"),
            times => format!("{name} touched down {times} times"),
        }
    }
}

/// The finding of the legs that have a number, if it is a violation or no number is missing.
fn either(finding: Option<Finding>, missing: Option<Finding>) -> Finding {
    match (finding, missing) {
        (Some(finding), None) => finding,
        (Some(finding), Some(_)) if finding.verdict == Verdict::Fail => finding,
        (_, Some(missing)) => missing,
        (None, None) => Finding::unobserved("no footstep"),
    }
}

/// Limits of a number that may still grow: it has not failed by being too small yet.
fn not_below(limits: &Limits) -> Limits {
    Limits {
        min: None,
        max: Some(limits.max.unwrap_or(f64::INFINITY)),
    }
}

fn chosen(choice: &LegChoice, all: &[LegFact]) -> Vec<usize> {
    let chosen = |leg: &LegFact| match choice {
        LegChoice::All => true,
        LegChoice::Fore => leg.fore,
        LegChoice::Hind => !leg.fore,
        LegChoice::Named(names) => names.iter().any(|name| name.value == leg.name),
    };
    let legs = all.iter().enumerate();
    let legs = legs.filter(|(_, leg)| chosen(leg));
    legs.map(|(index, _)| index).collect()
}
