//! The phases in which legs touch down.

use std::f64::consts::TAU;

use twinrig_kernel::SimTime;

use crate::expect::Pattern;
use crate::judge::outcome::Finding;
use crate::judge::touch_downs::TouchDown;
use crate::limits::Limits;
use crate::scene::LegFact;

/// So many touch-downs of another leg may fall into one cycle of the first leg. A cycle that long
/// is none.
const MOST: usize = 1024;

/// The phases of legs in the cycle of the first of them, touch-down to touch-down.
#[derive(Clone, Debug)]
pub(super) struct Phases {
    first: usize,
    /// When the cycle that lasts began.
    begin: Option<SimTime>,
    /// Number of touch-downs of the first leg.
    begins: u64,
    others: Vec<Shares>,
    /// A leg of which too many touch-downs fell into one cycle.
    crowded: Option<usize>,
}

/// The touch-downs of one leg, as shares of the cycle.
#[derive(Clone, Debug)]
struct Shares {
    leg: usize,
    /// Sum of the unit vectors of those in cycles that are over.
    x: f64,
    y: f64,
    count: u64,
    /// Those in the cycle that lasts.
    pending: Vec<SimTime>,
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
    /// Of these legs; none if they are fewer than two.
    pub fn new(legs: &[usize]) -> Option<Self> {
        let [first, others @ ..] = legs else {
            return None;
        };
        let shares = |leg: &usize| Shares {
            leg: *leg,
            x: 0.0,
            y: 0.0,
            count: 0,
            pending: Vec::with_capacity(4),
        };
        (!others.is_empty()).then(|| Phases {
            first: *first,
            begin: None,
            begins: 0,
            others: others.iter().map(shares).collect(),
            crowded: None,
        })
    }

    /// Takes the touch-downs in the order of time.
    pub fn touch_down(&mut self, TouchDown { at, leg }: TouchDown) {
        if leg == self.first {
            if let Some(begin) = self.begin {
                let cycle = (at - begin).as_secs_f64();
                for other in &mut self.others {
                    other.close(begin, cycle);
                }
            }
            self.begin = Some(at);
            self.begins += 1;
            return;
        }
        // A touch-down before the first cycle is in none.
        if self.begin.is_none() {
            return;
        }
        if let Some(other) = self.others.iter_mut().find(|other| other.leg == leg) {
            if other.pending.len() < MOST {
                other.pending.push(at);
            } else {
                self.crowded = Some(leg);
            }
        }
    }

    /// The phases of all legs, or why those of some are missing: of the first, of one of the others.
    fn all(&self, touched: &dyn Fn(usize) -> String) -> (Vec<LegPhase>, Option<Finding>) {
        if self.begins < 3 {
            return (Vec::new(), Some(Finding::unobserved(touched(self.first))));
        }
        if let Some(leg) = self.crowded {
            let many = format!("{}, too often in one cycle of the first leg", touched(leg));
            return (Vec::new(), Some(Finding::unobserved(many)));
        }
        let mut missing = None;
        let mut phases = Vec::new();
        for other in &self.others {
            // A leg that is seen in less than half of the cycles has no phase in them.
            if 2 * other.count < self.begins - 1 {
                missing = missing.or_else(|| Some(Finding::unobserved(touched(other.leg))));
            } else {
                phases.push(other.phase());
            }
        }
        (phases, missing)
    }

    /// Every leg's mean phase is the pattern's. Phases that are missing come with the finding of
    /// those that are not.
    pub fn finding(
        &self,
        legs: &[LegFact],
        pattern: &Pattern,
        tolerance: f64,
        touched: &dyn Fn(usize) -> String,
    ) -> (Option<Finding>, Option<Finding>) {
        let (phases, missing) = self.all(touched);
        let unknown = |leg: usize| {
            let name = &legs[leg].name;
            let why = format!("the pattern does not say where {name} is");
            (None, Some(Finding::unobserved(why)))
        };
        let Some(base) = share(pattern, &legs[self.first]) else {
            return unknown(self.first);
        };
        let mut worst: Option<(f64, String)> = None;
        for phase in phases {
            let leg = &legs[phase.leg];
            let Some(wanted) = share(pattern, leg) else {
                return unknown(phase.leg);
            };
            let wanted = wrap(wanted - base);
            let off = (wrap(phase.mean - wanted + 0.5) - 0.5).abs();
            if worst.as_ref().is_none_or(|(known, _)| off >= *known) {
                let first = &legs[self.first].name;
                let detail = format!(
                    "worst: {} at {:.3} of {first}'s cycle, wanted {wanted:.2}",
                    leg.name, phase.mean
                );
                worst = Some((off, detail));
            }
        }
        let within = Limits::at_most(tolerance);
        let finding =
            worst.map(|(off, detail)| Finding::of(within.compare(off, off), None, detail));
        (finding, missing)
    }

    /// How much every leg's phase varies.
    pub fn spread(
        &self,
        legs: &[LegFact],
        limits: &Limits,
        touched: &dyn Fn(usize) -> String,
    ) -> (Option<Finding>, Option<Finding>) {
        let (phases, missing) = self.all(touched);
        if phases.is_empty() {
            return (None, missing);
        }
        let (mut least, mut greatest) = (f64::INFINITY, 0.0_f64);
        let mut detail = String::new();
        for phase in phases {
            least = least.min(phase.spread);
            if phase.spread >= greatest {
                greatest = phase.spread;
                detail = format!("worst: {}", legs[phase.leg].name);
            }
        }
        let finding = Finding::of(limits.compare(least, greatest), None, detail);
        (Some(finding), missing)
    }
}

impl Shares {
    /// The cycle that began at `begin` is over, and took so many seconds.
    fn close(&mut self, begin: SimTime, cycle: f64) {
        for at in self.pending.drain(..) {
            let share = (at - begin).as_secs_f64() / cycle;
            self.x += libm::cos(TAU * share);
            self.y += libm::sin(TAU * share);
            self.count += 1;
        }
    }

    fn phase(&self) -> LegPhase {
        let (x, y) = (self.x, self.y);
        let length = ((x * x + y * y).sqrt() / self.count as f64).min(1.0);
        LegPhase {
            leg: self.leg,
            mean: wrap(libm::atan2(y, x) / TAU),
            spread: (-2.0 * libm::log(length)).max(0.0).sqrt() / TAU,
        }
    }
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
