//! Cyclic order of touch-downs.

use twinrig_kernel::SimTime;

use crate::judge::outcome::{Finding, Verdict};
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
    violated_at: Option<SimTime>,
}

impl TouchDownOrder {
    pub fn new(groups: Vec<Vec<usize>>) -> Self {
        TouchDownOrder {
            done: Vec::with_capacity(groups.iter().map(Vec::len).max().unwrap_or(0)),
            groups,
            current: None,
            total: 0,
            out_of_order: 0,
            violated_at: None,
        }
    }

    /// Adds a touch-down; touch-downs arrive in temporal order.
    pub fn touch_down(&mut self, TouchDown { at, leg }: TouchDown) {
        let mut groups = self.groups.iter();
        let Some(group) = groups.position(|group| group.contains(&leg)) else {
            return;
        };
        self.total += 1;
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
            self.violated_at.get_or_insert(at);
        }
        self.current = Some(group);
        self.done.clear();
        self.done.push(leg);
    }

    pub fn finding(&self) -> Finding {
        let count = self.out_of_order as f64;
        let detail = format!("of {} touch-downs", self.total);
        let finding = Finding::of(
            Limits::at_most(0.0).compare(count, count),
            self.violated_at,
            detail,
        );
        let two_rounds = 2 * self.groups.iter().map(Vec::len).sum::<usize>() as u64;
        if finding.verdict == Verdict::Pass && self.total < two_rounds {
            let detail = format!("{} touch-downs are not two rounds", self.total);
            return Finding::unobserved(detail);
        }
        finding
    }
}
