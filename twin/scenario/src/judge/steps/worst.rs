//! The worst of a number that every footstep has.

use twinrig_kernel::SimTime;

use crate::judge::outcome::Finding;
use crate::limits::Limits;

/// The worst number of one leg so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Worst {
    /// The number and the touch-down of its footstep; none before the first.
    found: Option<(f64, SimTime)>,
    /// The first touch-down of a footstep whose number is beyond the limits.
    violated_at: Option<SimTime>,
}

impl Worst {
    pub fn add(&mut self, touch_down: SimTime, number: f64, limits: &Limits) {
        let margin = limits.margin(number);
        if margin < 0.0 {
            self.violated_at.get_or_insert(touch_down);
        }
        let worse = |(known, _): (f64, SimTime)| margin < limits.margin(known);
        if self.found.is_none_or(worse) {
            self.found = Some((number, touch_down));
        }
    }

    pub fn is_empty(&self) -> bool {
        self.found.is_none()
    }
}

/// The finding of the worst of all legs, given with their names; none if no leg has a number.
pub(super) fn finding<'n>(
    legs: impl Iterator<Item = (&'n str, Worst)>,
    limits: &Limits,
) -> Option<Finding> {
    let mut worst: Option<(&str, f64, SimTime)> = None;
    let mut violated_at: Option<SimTime> = None;
    for (name, leg) in legs {
        let Some((number, at)) = leg.found else {
            continue;
        };
        let earlier = leg.violated_at.into_iter().chain(violated_at).min();
        violated_at = earlier;
        if worst.is_none_or(|(_, known, _)| limits.margin(number) < limits.margin(known)) {
            worst = Some((name, number, at));
        }
    }
    let (name, number, at) = worst?;
    let detail = format!("worst: {name} at {:.3} s", at.as_secs_f64());
    Some(Finding::of(
        limits.compare(number, number),
        violated_at,
        detail,
    ))
}
