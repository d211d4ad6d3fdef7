//! Numbers of all footsteps of a leg together.

use twinrig_kernel::SimTime;

use crate::judge::footstep::Footstep;
use crate::judge::outcome::Finding;
use crate::limits::Limits;

/// What of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mean {
    /// Mean share of the cycle, touch-down to touch-down, that the leg stands.
    DutyFactor,
    /// Touch-downs a second.
    Frequency,
    /// Number of touch-downs.
    Count,
}

/// The footsteps of one leg so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cycles {
    count: u64,
    first: Option<SimTime>,
    /// Touch-down of the last footstep, and how long the leg stood \[s\].
    last: Option<(SimTime, Option<f64>)>,
    /// Sum over the cycles of the share that the leg stood; none if one of them has none.
    shares: Option<f64>,
}

impl Cycles {
    pub fn add(&mut self, step: &Footstep) {
        if let Some((begin, stance)) = self.last {
            let cycle = (step.touch_down - begin).as_secs_f64();
            let share = stance.map(|stance| stance / cycle);
            let shares = if self.count == 1 {
                Some(0.0)
            } else {
                self.shares
            };
            self.shares = shares.and_then(|sum| Some(sum + share?));
        }
        self.first.get_or_insert(step.touch_down);
        self.last = Some((step.touch_down, step.stance()));
        self.count += 1;
    }

    fn number(&self, of: Mean) -> Option<f64> {
        match of {
            Mean::Count => Some(self.count as f64),
            Mean::DutyFactor => {
                let cycles = self.count.checked_sub(1).filter(|cycles| *cycles > 0)?;
                Some(self.shares? / cycles as f64)
            }
            Mean::Frequency => {
                let cycles = self.count.checked_sub(1).filter(|cycles| *cycles > 0)?;
                let (last, _) = self.last?;
                let time = (last - self.first?).as_secs_f64();
                Some(cycles as f64 / time)
            }
        }
    }
}

/// The finding of the worst of all legs, and the first leg, by its place among them, that has no
/// number.
pub(super) fn finding<'n>(
    legs: impl Iterator<Item = (&'n str, Cycles)>,
    of: Mean,
    limits: &Limits,
) -> (Option<Finding>, Option<usize>) {
    let mut worst: Option<(&str, f64)> = None;
    let mut missing = None;
    for (place, (name, cycles)) in legs.enumerate() {
        let Some(number) = cycles.number(of) else {
            missing = missing.or(Some(place));
            continue;
        };
        if worst.is_none_or(|(_, known)| limits.margin(number) < limits.margin(known)) {
            worst = Some((name, number));
        }
    }
    let finding = worst.map(|(name, number)| {
        let detail = format!("worst: {name}");
        Finding::of(limits.compare(number, number), None, detail)
    });
    (finding, missing)
}
