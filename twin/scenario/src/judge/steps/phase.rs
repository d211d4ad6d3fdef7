//! Phases of legs, by their loads or their touch-downs.

use std::f64::consts::TAU;

use twinrig_kernel::SimTime;

use crate::expect::CycleMark;
use crate::facts::LegFact;
use crate::judge::load_cycle::{LoadCycle, wrap};
use crate::judge::outcome::{Finding, Witness};
use crate::judge::touch_downs::TouchDown;
use crate::limits::Limits;
use crate::pattern::Pattern;

/// Largest number of touch-downs of another leg in one cycle of the first leg; a longer cycle is
/// not periodic motion.
const MAX_PER_CYCLE: usize = 1024;

/// Least number of cycles for a verdict.
const MIN_CYCLES: u64 = 2;

/// Phases of legs in the cycle of the first of them.
#[derive(Clone, Debug)]
pub(super) struct Phases {
    by: CycleMark,
    first: usize,
    /// Number of completed cycles.
    cycles: u64,
    /// Touch-down of the first leg that began the present cycle.
    begin: Option<SimTime>,
    others: Vec<Shares>,
    /// Leg with too many touch-downs in one cycle.
    overflowed: Option<usize>,
}

/// Phases of one leg as shares of the cycle.
#[derive(Clone, Debug)]
struct Shares {
    leg: usize,
    /// Phases in completed cycles.
    sum: CircularSum,
    /// Touch-downs in the present cycle.
    pending: Vec<SimTime>,
}

/// Sum of unit vectors.
#[derive(Clone, Copy, Debug, Default)]
struct CircularSum {
    x: f64,
    y: f64,
    count: u64,
}

/// Mean and spread of the phase of one leg in the cycle of another.
struct LegPhase {
    leg: usize,
    /// Circular mean, as a share of the cycle.
    mean: f64,
    /// Circular standard deviation, as a share of the cycle.
    spread: f64,
}

impl Phases {
    /// Creates the statistics of these legs; none if there are fewer than two.
    pub fn new(by: CycleMark, legs: &[usize]) -> Option<Self> {
        let [first, others @ ..] = legs else {
            return None;
        };
        let shares = |leg: &usize| Shares {
            leg: *leg,
            sum: CircularSum::default(),
            pending: Vec::with_capacity(4),
        };
        (!others.is_empty()).then(|| Phases {
            by,
            first: *first,
            cycles: 0,
            begin: None,
            others: others.iter().map(shares).collect(),
            overflowed: None,
        })
    }

    /// Returns whether it evaluates cycles of the loads.
    pub fn reads_load_cycles(&self) -> bool {
        self.by == CycleMark::Load
    }

    /// Adds a cycle of the loads.
    pub fn load_cycle(&mut self, cycle: &LoadCycle) {
        if !self.reads_load_cycles() {
            return;
        }
        self.cycles += 1;
        for other in &mut self.others {
            if let Some(phase) = cycle.phase(other.leg, self.first) {
                other.sum.add(phase);
            }
        }
    }

    /// Adds a touch-down; touch-downs arrive in temporal order.
    pub fn touch_down(&mut self, TouchDown { at, leg }: TouchDown) {
        if self.by != CycleMark::TouchDown {
            return;
        }
        if leg == self.first {
            if let Some(begin) = self.begin {
                let cycle = (at - begin).as_secs_f64();
                for other in &mut self.others {
                    other.close(begin, cycle);
                }
                self.cycles += 1;
            }
            self.begin = Some(at);
            return;
        }
        // Touch-downs before the first cycle are ignored.
        if self.begin.is_none() {
            return;
        }
        if let Some(other) = self.others.iter_mut().find(|other| other.leg == leg) {
            if other.pending.len() < MAX_PER_CYCLE {
                other.pending.push(at);
            } else {
                self.overflowed = Some(leg);
            }
        }
    }

    /// Returns the phases of the legs, and the reason if some are missing.
    fn all(&self, detail_of: &dyn Fn(usize) -> String) -> (Vec<LegPhase>, Option<Finding>) {
        if self.cycles < MIN_CYCLES {
            let detail = match self.by {
                CycleMark::Load => format!("the loads have {} cycles in its time", self.cycles),
                CycleMark::TouchDown => detail_of(self.first),
            };
            return (Vec::new(), Some(Finding::unobserved(detail)));
        }
        if let Some(leg) = self.overflowed {
            let detail = format!(
                "{}, too often in one cycle of the first leg",
                detail_of(leg)
            );
            return (Vec::new(), Some(Finding::unobserved(detail)));
        }
        let mut missing = None;
        let mut phases = Vec::new();
        for other in &self.others {
            // A leg with a phase in less than half of the cycles has none.
            if 2 * other.sum.count < self.cycles {
                missing = missing.or_else(|| Some(Finding::unobserved(detail_of(other.leg))));
            } else {
                phases.push(other.phase());
            }
        }
        (phases, missing)
    }

    /// Returns the deviation of the mean phases from a pattern, and the finding for missing phases.
    pub fn finding(
        &self,
        legs: &[LegFact],
        pattern: &Pattern,
        tolerance: f64,
        detail_of: &dyn Fn(usize) -> String,
    ) -> (Option<Finding>, Option<Finding>) {
        let (phases, missing) = self.all(detail_of);
        let unknown = |leg: usize| {
            let name = &legs[leg].name;
            let detail = format!("the pattern has no phase of {name}");
            (None, Some(Finding::unobserved(detail)))
        };
        let Some(base) = pattern.share(&legs[self.first]) else {
            return unknown(self.first);
        };
        let mut worst: Option<(f64, Witness, String)> = None;
        for phase in phases {
            let leg = &legs[phase.leg];
            let Some(expected) = pattern.share(leg) else {
                return unknown(phase.leg);
            };
            let expected = wrap(expected - base);
            let deviation = (wrap(phase.mean - expected + 0.5) - 0.5).abs();
            if worst
                .as_ref()
                .is_none_or(|(greatest, ..)| deviation >= *greatest)
            {
                let first = &legs[self.first].name;
                let detail = format!(
                    "worst: {} at {:.3} of {first}'s cycle, expected {expected:.2}",
                    leg.name, phase.mean
                );
                let witness = Witness {
                    value: Some(phase.mean),
                    ..Witness::of_leg(&leg.name)
                };
                worst = Some((deviation, witness, detail));
            }
        }
        let within = Limits::at_most(tolerance);
        let finding = worst.map(|(deviation, witness, detail)| {
            Finding::of(within.compare(deviation, deviation), None, detail).seen(witness)
        });
        (finding, missing)
    }

    /// Returns the finding of the spread of the phases, and that for missing ones.
    pub fn spread(
        &self,
        legs: &[LegFact],
        limits: &Limits,
        detail_of: &dyn Fn(usize) -> String,
    ) -> (Option<Finding>, Option<Finding>) {
        let (phases, missing) = self.all(detail_of);
        if phases.is_empty() {
            return (None, missing);
        }
        let (mut least, mut greatest) = (f64::INFINITY, 0.0_f64);
        let mut witness = Witness::default();
        for phase in phases {
            least = least.min(phase.spread);
            if phase.spread >= greatest {
                greatest = phase.spread;
                witness = Witness {
                    value: Some(greatest),
                    ..Witness::of_leg(&legs[phase.leg].name)
                };
            }
        }
        let leg = witness.leg.as_deref().unwrap_or_default();
        let detail = format!("worst: {leg}");
        let finding = Finding::of(limits.compare(least, greatest), None, detail);
        (Some(finding.seen(witness)), missing)
    }
}

impl Shares {
    /// Adds the phases of the pending touch-downs at the end of the cycle that began at `begin` and
    /// took `cycle` seconds.
    fn close(&mut self, begin: SimTime, cycle: f64) {
        for at in self.pending.drain(..) {
            let share = (at - begin).as_secs_f64() / cycle;
            self.sum.add(share);
        }
    }

    fn phase(&self) -> LegPhase {
        let CircularSum { x, y, count } = self.sum;
        let length = ((x * x + y * y).sqrt() / count as f64).min(1.0);
        LegPhase {
            leg: self.leg,
            mean: wrap(libm::atan2(y, x) / TAU),
            spread: (-2.0 * libm::log(length)).max(0.0).sqrt() / TAU,
        }
    }
}

impl CircularSum {
    fn add(&mut self, share: f64) {
        let (sine, cosine) = libm::sincos(TAU * share);
        self.x += cosine;
        self.y += sine;
        self.count += 1;
    }
}
