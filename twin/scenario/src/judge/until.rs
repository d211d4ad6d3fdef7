//! Elements within limits until a condition first holds.

use twinrig_kernel::SimTime;

use super::Verdict;
use super::condition::{SampledCondition, greatest, least};
use super::outcome::{Finding, Witness};
use crate::limits::{Comparison, Limits};

/// Statistics of `always` with `until`.
///
/// The margin is the robustness in Signal Temporal Logic: the greatest, over all samples, of the
/// smaller one of the condition's margin there and the least margin of the elements before. In
/// another unit than theirs, the condition counts as ∞ where it holds and −∞ elsewhere.
#[derive(Clone, Debug)]
pub(crate) struct Until {
    elements: Vec<usize>,
    limits: Limits,
    condition: SampledCondition,
    has_one_unit: bool,
    /// Least margin of the elements before this sample.
    before: Option<Comparison>,
    /// Element and instant of that margin.
    worst: Option<(usize, SimTime)>,
    robustness: Option<Comparison>,
    event_at: Option<SimTime>,
    first_violation: Option<SimTime>,
    non_finite_at: Option<SimTime>,
    /// Whether later samples have no influence.
    is_complete: bool,
    is_empty: bool,
}

impl Until {
    pub fn new(
        elements: Vec<usize>,
        limits: Limits,
        condition: SampledCondition,
        has_one_unit: bool,
    ) -> Self {
        Until {
            elements,
            limits,
            condition,
            has_one_unit,
            before: None,
            worst: None,
            robustness: None,
            event_at: None,
            first_violation: None,
            non_finite_at: None,
            is_complete: false,
            is_empty: true,
        }
    }

    /// Evaluates a sample and returns whether it precedes the event.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> bool {
        if self.is_complete {
            return false;
        }
        let condition = self.condition.compare(self.condition.value(values));
        let holds = condition.margin >= 0.0;
        if holds && self.event_at.is_none() {
            self.event_at = Some(now);
            self.is_complete = !self.has_one_unit;
        }
        let here = match self.before {
            Some(before) if self.has_one_unit => Some(least(condition, before)),
            Some(before) => holds.then_some(before),
            None => self.has_one_unit.then_some(condition),
        };
        if let Some(here) = here.filter(|here| !here.margin.is_nan()) {
            self.robustness = Some(self.robustness.map_or(here, |best| greatest(best, here)));
        }
        if !self.is_complete {
            self.add_elements(now, values);
        }
        self.event_at.is_none()
    }

    fn add_elements(&mut self, now: SimTime, values: &[f64]) {
        for &element in &self.elements {
            let comparison = self.limits.compare(values[element], values[element]);
            if !values[element].is_finite() {
                self.is_complete = true;
                if self.event_at.is_none() {
                    self.non_finite_at = Some(now);
                }
                return;
            }
            if comparison.margin < 0.0 && self.event_at.is_none() {
                self.first_violation.get_or_insert(now);
            }
            let before = self.before.map_or(comparison, |it| least(it, comparison));
            let is_worst = self.before.is_none_or(|it| comparison.margin < it.margin);
            if is_worst && self.event_at.is_none() {
                self.worst = Some((element, now));
            }
            self.before = Some(before);
        }
        self.is_empty &= self.event_at.is_some();
    }

    pub fn finding(&self) -> Finding {
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        if self.event_at.is_some() && self.is_empty {
            return Finding::unobserved("the `until` condition held from the start");
        }
        if self.is_empty {
            return Finding::unobserved("there is no observation in its window");
        }
        let (verdict, detail) = match self.event_at {
            None => (Verdict::Fail, "the `until` condition never held".to_owned()),
            Some(at) if self.first_violation.is_some() => (Verdict::Fail, format!("until {at}")),
            Some(at) => (Verdict::Pass, format!("until {at}")),
        };
        // Without the event the comparison may be that of the condition.
        let worst = self.worst.filter(|_| self.event_at.is_some());
        Finding {
            verdict,
            comparison: self.robustness,
            first_violation: self.first_violation,
            witness: Witness {
                at: worst.map(|(_, at)| at),
                ..Witness::default()
            },
            element: worst.map(|(element, _)| element),
            detail,
        }
    }
}
