//! Cyclic order of touch-downs.

use twinrig_kernel::SimTime;

use crate::facts::LegFact;
use crate::judge::outcome::{Finding, Verdict, Witness};
use crate::judge::touch_downs::TouchDown;
use crate::limits::Limits;

/// Cyclic order of groups of legs, and the touch-downs out of it.
#[derive(Clone, Debug)]
pub(super) struct TouchDownOrder {
    groups: Vec<Vec<usize>>,
    /// Present group; none before the first touch-down.
    current: Option<usize>,
    /// Legs of the present group that have touched down.
    done: Vec<usize>,
    total: u64,
    out_of_order: u64,
    /// First touch-down out of order.
    violation: Option<Violation>,
    /// Leg of the last touch-down.
    last: Option<usize>,
}

/// First touch-down out of order.
#[derive(Clone, Debug)]
struct Violation {
    at: SimTime,
    leg: usize,
    after: Option<usize>,
    /// Legs that could have come.
    expected: Vec<usize>,
}

impl TouchDownOrder {
    pub fn new(groups: Vec<Vec<usize>>) -> Self {
        TouchDownOrder {
            done: Vec::with_capacity(groups.iter().map(Vec::len).max().unwrap_or(0)),
            groups,
            current: None,
            total: 0,
            out_of_order: 0,
            violation: None,
            last: None,
        }
    }

    /// Adds a touch-down; touch-downs arrive in temporal order.
    pub fn touch_down(&mut self, TouchDown { at, leg }: TouchDown) {
        let mut groups = self.groups.iter();
        let Some(group) = groups.position(|group| group.contains(&leg)) else {
            return;
        };
        self.total += 1;
        let last = self.last.replace(leg);
        let in_order = match self.current {
            None => true,
            Some(current) if current == group && !self.done.contains(&leg) => {
                self.done.push(leg);
                return;
            }
            Some(current) => {
                let is_complete = self.done.len() == self.groups[current].len();
                is_complete && group == (current + 1) % self.groups.len()
            }
        };
        // The window may begin within a group, so the first group may be incomplete.
        let largest = self.groups.iter().map(Vec::len).max().unwrap_or(1);
        if !(in_order || self.total <= largest as u64) {
            self.out_of_order += 1;
            if self.violation.is_none() {
                self.violation = Some(Violation {
                    at,
                    leg,
                    after: last,
                    expected: self.expected(),
                });
            }
        }
        self.current = Some(group);
        self.done.clear();
        self.done.push(leg);
    }

    /// Returns the legs of the present group that have not touched down, or those of the next one.
    fn expected(&self) -> Vec<usize> {
        let Some(current) = self.current else {
            return Vec::new();
        };
        let rest = self.groups[current].iter().copied();
        let rest: Vec<usize> = rest.filter(|leg| !self.done.contains(leg)).collect();
        if rest.is_empty() {
            self.groups[(current + 1) % self.groups.len()].clone()
        } else {
            rest
        }
    }

    pub fn finding(&self, legs: &[LegFact]) -> Finding {
        let count = self.out_of_order as f64;
        let name = |leg: usize| legs[leg].name.as_str();
        let total = format!("of {} touch-downs", self.total);
        let comparison = Limits::at_most(0.0).compare(count, count);
        let finding = match &self.violation {
            None => Finding::of(comparison, None, total),
            Some(first) => {
                let expected: Vec<&str> = first.expected.iter().copied().map(name).collect();
                let after = first.after.map(|leg| format!(" after {}", name(leg)));
                let detail = format!(
                    "{}{} instead of {}, {total}",
                    name(first.leg),
                    after.unwrap_or_default(),
                    expected.join(" or ")
                );
                let witness = Witness {
                    at: Some(first.at),
                    ..Witness::of_leg(name(first.leg))
                };
                Finding::of(comparison, Some(first.at), detail).seen(witness)
            }
        };
        let two_rounds = 2 * self.groups.iter().map(Vec::len).sum::<usize>() as u64;
        if finding.verdict == Verdict::Pass && self.total < two_rounds {
            let detail = format!("{} touch-downs are not two rounds", self.total);
            return Finding::unobserved(detail);
        }
        finding
    }
}
