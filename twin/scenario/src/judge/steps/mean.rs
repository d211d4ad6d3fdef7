//! Mean values over the footsteps of a leg.

use twinrig_kernel::SimTime;

use super::displacement::minus;
use crate::expect::Axis;
use crate::judge::footstep::Footstep;
use crate::judge::load_cycle::LegCycle;
use crate::judge::outcome::{Finding, Witness};
use crate::limits::Limits;

/// Measure of the footsteps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mean {
    /// Mean share of the stance in the cycle.
    DutyFactor,
    /// Slip over the travel in stance.
    SlipShare,
    /// Mean rate of touch-downs.
    Frequency,
    /// Number of touch-downs.
    Count,
}

/// Running sums over the footsteps of one leg.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cycles {
    count: u64,
    first: Option<SimTime>,
    last: Option<Last>,
    /// Sum of the stance shares of the cycles; none if one of them has none.
    shares: Option<f64>,
    /// Sum of the slips and of the travels in stance of the same footsteps \[m\].
    slip: f64,
    travel: f64,
}

/// The last footstep.
#[derive(Clone, Copy, Debug)]
struct Last {
    touch_down: SimTime,
    /// Stance time \[s\].
    stance: Option<f64>,
    position: [f64; 3],
    slip: f64,
}

impl Cycles {
    pub fn add(&mut self, step: &Footstep) {
        if let Some(last) = self.last {
            let cycle = (step.touch_down - last.touch_down).as_secs_f64();
            let share = last.stance.map(|stance| stance / cycle);
            let stride = minus(step.position, last.position);
            let stride = Axis::Horizontal.along(stride);
            self.slip += last.slip;
            self.travel += stride * share.unwrap_or(1.0);
            let shares = if self.count == 1 {
                Some(0.0)
            } else {
                self.shares
            };
            self.shares = shares.and_then(|sum| Some(sum + share?));
        }
        self.first.get_or_insert(step.touch_down);
        self.last = Some(Last {
            touch_down: step.touch_down,
            stance: step.stance(),
            position: step.position,
            slip: step.slip,
        });
        self.count += 1;
    }

    pub fn value(&self, mean: Mean) -> Option<f64> {
        match mean {
            Mean::Count => Some(self.count as f64),
            Mean::DutyFactor => {
                let cycles = self.count.checked_sub(1).filter(|cycles| *cycles > 0)?;
                Some(self.shares? / cycles as f64)
            }
            Mean::SlipShare => (self.travel > 0.0).then(|| self.slip / self.travel),
            Mean::Frequency => {
                let cycles = self.count.checked_sub(1).filter(|cycles| *cycles > 0)?;
                let time = (self.last?.touch_down - self.first?).as_secs_f64();
                Some(cycles as f64 / time)
            }
        }
    }
}

/// Measure of the load of a leg in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LoadMean {
    /// Share of the cycle on the ground.
    DutyFactor,
    /// Number of contacts.
    Contacts,
}

/// Running sum over the cycles of the load of one leg.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LoadSum {
    count: u64,
    sum: f64,
}

impl LoadSum {
    pub fn add(&mut self, mean: LoadMean, cycle: &LegCycle) {
        self.count += 1;
        self.sum += match mean {
            LoadMean::DutyFactor => cycle.duty_factor,
            LoadMean::Contacts => cycle.contacts,
        };
    }

    /// Returns the mean; none without a cycle.
    pub fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// Returns the finding of the leg with the least margin, and the index of the first leg without a
/// value.
pub(super) fn finding<'n>(
    legs: impl Iterator<Item = (&'n str, Option<f64>)>,
    limits: &Limits,
) -> (Option<Finding>, Option<usize>) {
    let mut worst: Option<(&str, f64)> = None;
    let mut missing = None;
    for (place, (name, value)) in legs.enumerate() {
        let Some(value) = value else {
            missing = missing.or(Some(place));
            continue;
        };
        if worst.is_none_or(|(_, other)| limits.margin(value) < limits.margin(other)) {
            worst = Some((name, value));
        }
    }
    let finding = worst.map(|(name, value)| {
        let detail = format!("worst: {name}");
        let witness = Witness {
            value: Some(value),
            ..Witness::of_leg(name)
        };
        Finding::of(limits.compare(value, value), None, detail).seen(witness)
    });
    (finding, missing)
}
