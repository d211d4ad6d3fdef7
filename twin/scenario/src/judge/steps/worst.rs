//! Least margin of a value of every footstep.

use twinrig_kernel::SimTime;

use crate::judge::outcome::{Finding, Witness};
use crate::limits::Limits;

/// Value of one leg with the least margin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Worst {
    /// Value and touch-down of its footstep; none before the first footstep.
    found: Option<(f64, SimTime)>,
    /// First touch-down of a footstep that violates the limits.
    violated_at: Option<SimTime>,
}

impl Worst {
    pub fn add(&mut self, touch_down: SimTime, value: f64, limits: &Limits) {
        let margin = limits.margin(value);
        if margin < 0.0 {
            self.violated_at.get_or_insert(touch_down);
        }
        let worse = |(other, _): (f64, SimTime)| margin < limits.margin(other);
        if self.found.is_none_or(worse) {
            self.found = Some((value, touch_down));
        }
    }

    pub fn is_empty(&self) -> bool {
        self.found.is_none()
    }
}

/// Returns the finding of the leg with the least margin; none if no leg has a value.
pub(super) fn finding<'n>(
    legs: impl Iterator<Item = (&'n str, Worst)>,
    limits: &Limits,
) -> Option<Finding> {
    let mut worst: Option<(&str, f64, SimTime)> = None;
    let mut violated_at: Option<SimTime> = None;
    for (name, leg) in legs {
        let Some((value, at)) = leg.found else {
            continue;
        };
        let earlier = leg.violated_at.into_iter().chain(violated_at).min();
        violated_at = earlier;
        if worst.is_none_or(|(_, other, _)| limits.margin(value) < limits.margin(other)) {
            worst = Some((name, value, at));
        }
    }
    let (name, value, at) = worst?;
    let detail = format!("worst: {name} at {:.3} s", at.as_secs_f64());
    let finding = Finding::of(limits.compare(value, value), violated_at, detail);
    Some(finding.seen(Witness::of_leg(name).at(at, value)))
}
