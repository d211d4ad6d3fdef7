//! Statistics for one expectation of the sequence of two conditions.

use std::collections::VecDeque;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Group;

use super::Verdict;
use super::condition::SampledCondition;
use super::outcome::{Finding, Witness};
use super::sliding_max::SlidingMax;
use crate::limits::Comparison;
use crate::sequence::Relation;

/// Sequence of two conditions.
///
/// The time base is the instants at which one of both is sampled; between its samples a signal is
/// held. An instant is evaluated when time has advanced, so that the order of the samples at one
/// instant has no influence. The state is bounded by the samples of the time window.
#[derive(Clone, Debug)]
pub(crate) struct SequenceMeter {
    whenever: SampledCondition,
    other: SampledCondition,
    relation: Relation,
    /// Last values of both.
    last: [Option<f64>; 2],
    /// Instant whose samples may be incomplete.
    open: Option<SimTime>,
    /// First evaluated instant.
    start: Option<SimTime>,
    /// Values of the first condition at the instants whose window is incomplete.
    pending: VecDeque<(SimTime, f64)>,
    /// Values of the other condition.
    greatest: SlidingMax,
    /// Number of judged instants.
    judged: u64,
    /// Whether the first condition held at one of them.
    has_occurred: bool,
    robustness: Option<Comparison>,
    /// Whether the robustness is that of the first condition.
    of_whenever: bool,
    first_violation: Option<SimTime>,
    interval: Interval,
    non_finite_at: Option<SimTime>,
}

/// Greatest time between both conditions.
#[derive(Clone, Copy, Debug, Default)]
struct Interval {
    /// Of a response the time of the first one that is due, of a precedence the last time at which
    /// the other condition held.
    since: Option<SimTime>,
    /// The greatest time, and when the first condition held.
    longest: Option<(SimDuration, SimTime)>,
}

impl SequenceMeter {
    /// Creates a meter; its window has about `count` samples.
    pub fn new(
        whenever: SampledCondition,
        other: SampledCondition,
        relation: Relation,
        count: usize,
    ) -> Self {
        let count = match relation {
            Relation::Before(None) => 1,
            _ => count,
        };
        SequenceMeter {
            whenever,
            other,
            relation,
            last: [None; 2],
            open: None,
            start: None,
            pending: VecDeque::with_capacity(count),
            greatest: SlidingMax::with_capacity(count),
            judged: 0,
            has_occurred: false,
            robustness: None,
            of_whenever: false,
            first_violation: None,
            interval: Interval::default(),
            non_finite_at: None,
        }
    }

    /// Returns whether it evaluates samples of a group.
    pub fn reads(&self, group: Group) -> bool {
        group == self.whenever.group || group == self.other.group
    }

    /// Evaluates samples of a group and returns the number of instants that they complete.
    /// `in_window`: whether `now` is within the meter's window.
    #[inline]
    pub fn sample(&mut self, now: SimTime, group: Group, values: &[f64], in_window: bool) -> u64 {
        if self.non_finite_at.is_some() {
            return 0;
        }
        let judged = self.judged;
        if self.open.is_some_and(|open| open < now) {
            self.close();
        }
        for (condition, last) in [&self.whenever, &self.other]
            .into_iter()
            .zip(&mut self.last)
        {
            if condition.group == group {
                *last = Some(condition.value(values));
            }
        }
        if in_window {
            self.open = Some(now);
        }
        self.judged - judged
    }

    /// Evaluates the open instant and returns the number of judged instants.
    pub fn finish(&mut self) -> u64 {
        self.close();
        self.judged
    }

    fn close(&mut self) {
        let (Some(now), [Some(whenever), Some(other)]) = (self.open.take(), self.last) else {
            return;
        };
        if !(whenever.is_finite() && other.is_finite()) {
            self.non_finite_at.get_or_insert(now);
            return;
        }
        match self.relation {
            Relation::Then(within) => self.close_response(now, whenever, other, within),
            Relation::Before(within) => self.close_precedence(now, whenever, other, within),
        }
    }

    fn close_response(&mut self, now: SimTime, whenever: f64, other: f64, within: SimDuration) {
        let is_over =
            |at: SimTime, now: SimTime| at.checked_add(within).is_some_and(|end| end < now);
        self.judge_pending(|at| is_over(at, now));
        self.pending.push_back((now, whenever));
        let margin = self.other.limits.margin(other);
        self.greatest.add(now, other, margin);
        if self.whenever.limits.hold(whenever) {
            self.interval.since.get_or_insert(now);
        }
        if margin >= 0.0
            && let Some(since) = self
                .interval
                .since
                .take()
                .filter(|since| !is_over(*since, now))
        {
            self.interval.add(now - since, since);
        }
        self.judge_pending(|at| at.checked_add(within) == Some(now));
    }

    /// Judges the pending instants whose window is complete.
    fn judge_pending(&mut self, is_complete: impl Fn(SimTime) -> bool) {
        while let Some((at, whenever)) =
            self.pending.front().copied().filter(|it| is_complete(it.0))
        {
            self.pending.pop_front();
            if let Some(other) = self.greatest.from(at) {
                self.judge(at, whenever, other);
            }
        }
    }

    fn close_precedence(
        &mut self,
        now: SimTime,
        whenever: f64,
        other: f64,
        within: Option<SimDuration>,
    ) {
        let margin = self.other.limits.margin(other);
        // Of a window that only grows the greatest value is enough.
        if within.is_some() || self.greatest.greatest().is_none_or(|best| margin > best) {
            self.greatest.add(now, other, margin);
        }
        if margin >= 0.0 {
            self.interval.since = Some(now);
        }
        let start = *self.start.get_or_insert(now);
        let from = match within {
            None => start,
            Some(within) if now - start < within => return,
            Some(within) => SimTime::ZERO + (now.since_start() - within),
        };
        if let Some(other) = self.greatest.from(from) {
            self.judge(now, whenever, other);
        }
        if self.whenever.limits.hold(whenever)
            && let Some(since) = self.interval.since.filter(|since| *since >= from)
        {
            self.interval.add(now - since, now);
        }
    }

    /// Judges an instant at which the first condition has the value `whenever`, by the best value
    /// of the other one in its window.
    fn judge(&mut self, at: SimTime, whenever: f64, other: f64) {
        self.judged += 1;
        let holds = self.whenever.limits.hold(whenever);
        self.has_occurred |= holds;
        if holds && !self.other.limits.hold(other) {
            self.first_violation.get_or_insert(at);
        }
        let required = self.other.compare(other);
        let here = if self.whenever.unit == self.other.unit {
            let negated = self.whenever.compare_negated(whenever);
            if negated.margin > required.margin {
                (negated, true)
            } else {
                (required, false)
            }
        } else if holds {
            (required, false)
        } else {
            return;
        };
        if self
            .robustness
            .is_none_or(|worst| here.0.margin < worst.margin)
        {
            (self.robustness, self.of_whenever) = (Some(here.0), here.1);
        }
    }

    pub fn finding(&self) -> Finding {
        if self.non_finite_at.is_some() {
            return Finding::not_a_number(self.non_finite_at);
        }
        if self.judged == 0 {
            return Finding::unobserved("no time window of it was observed completely");
        }
        if !self.has_occurred {
            return Finding::unobserved("the `whenever` condition never held");
        }
        let verdict = match self.first_violation {
            Some(_) => Verdict::Fail,
            None => Verdict::Pass,
        };
        Finding {
            verdict,
            comparison: self.robustness,
            first_violation: self.first_violation,
            witness: Witness {
                at: self.first_violation,
                ..Witness::default()
            },
            element: None,
            detail: self.detail(verdict),
        }
    }

    fn detail(&self, verdict: Verdict) -> String {
        let mut detail = match (self.relation, verdict, self.interval.longest) {
            (Relation::Then(within), Verdict::Fail, _) => {
                format!("no response within {}", milliseconds(within))
            }
            (Relation::Before(Some(within)), Verdict::Fail, _) => {
                format!("not preceded within {}", milliseconds(within))
            }
            (Relation::Before(None), Verdict::Fail, _) => "not preceded".to_owned(),
            (_, _, Some((SimDuration::ZERO, _))) => "both at the same time".to_owned(),
            (Relation::Then(_), _, Some((longest, at))) => {
                format!("slowest response: {} from {at}", milliseconds(longest))
            }
            (Relation::Before(_), _, Some((longest, at))) => {
                format!("preceded by {} at most, at {at}", milliseconds(longest))
            }
            (_, _, None) => String::new(),
        };
        if self.of_whenever {
            detail.push_str(", margin of `whenever`");
        }
        detail
    }
}

impl Interval {
    /// Adds the time between both conditions, of which the first held at `at`.
    fn add(&mut self, time: SimDuration, at: SimTime) {
        if self.longest.is_none_or(|(longest, _)| time > longest) {
            self.longest = Some((time, at));
        }
    }
}

fn milliseconds(time: SimDuration) -> String {
    format!("{} ms", time.as_nanos() as f64 / 1e6)
}
