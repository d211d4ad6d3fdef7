//! Watching a cycle: iterations of the controller, or transfers of a bus.

use twinrig_kernel::{CycleJitter, SimDuration, SimTime};

use super::CycleEvent;
use super::outcome::{Finding, Verdict};
use super::tracker::{Extremes, seconds};
use crate::expect::TimingMeasure;
use crate::limits::Limits;

/// Watches the events of one cycle.
#[derive(Clone, Debug)]
pub(crate) struct CycleMeter {
    measure: TimingMeasure,
    limits: Limits,
    jitter: CycleJitter,
    first_begin: Option<SimTime>,
    last_begin: Option<SimTime>,
    begins: u64,
    missed: u64,
    /// Whether the cycle that began last has not ended.
    running: bool,
    /// Jitter, latency or time between two begins \[s\].
    seen: Extremes,
    /// Shortest and longest time between two begins.
    between: Option<(SimDuration, SimDuration)>,
    first_miss: Option<SimTime>,
    last_missed: Option<SimTime>,
}

/// Fewer begins of a cycle say nothing about it.
const LEAST_BEGINS: u64 = 3;

impl CycleMeter {
    pub fn new(measure: TimingMeasure, limits: Limits, period: SimDuration) -> Self {
        CycleMeter {
            measure,
            limits,
            jitter: CycleJitter::new(period),
            first_begin: None,
            last_begin: None,
            begins: 0,
            missed: 0,
            running: false,
            seen: Extremes::default(),
            between: None,
            first_miss: None,
            last_missed: None,
        }
    }

    pub fn event(&mut self, now: SimTime, happening: CycleEvent) {
        match happening {
            CycleEvent::Begin => {
                let jitter = self.jitter.begin(now);
                if let (Some(last), Some(jitter)) = (self.last_begin, jitter) {
                    self.begun_again(now, now - last, jitter);
                }
                self.first_begin.get_or_insert(now);
                self.last_begin = Some(now);
                self.running = true;
                self.begins += 1;
            }
            CycleEvent::End => {
                self.running = false;
                if let (TimingMeasure::Latency, Some(begin)) = (self.measure, self.last_begin) {
                    let latency = seconds(now - begin);
                    self.seen.add_within(now, latency, &self.limits);
                }
            }
            CycleEvent::Missed => {
                self.missed += 1;
                let missed = self.missed as f64;
                if self.first_miss.is_none() && !self.limits.hold(missed) {
                    self.first_miss = Some(now);
                }
                self.last_missed = Some(now);
                if let Some(at_least) = self.at_least(now) {
                    self.seen.add_within(now, at_least, &self.limits);
                }
            }
        }
    }

    fn begun_again(&mut self, now: SimTime, between: SimDuration, jitter: SimDuration) {
        let (shortest, longest) = self.between.unwrap_or((between, between));
        self.between = Some((shortest.min(between), longest.max(between)));
        let value = match self.measure {
            TimingMeasure::Jitter => jitter,
            TimingMeasure::LongestCycle => between,
            TimingMeasure::DeadlineMisses
            | TimingMeasure::CycleRate
            | TimingMeasure::Latency
            | TimingMeasure::HalfRange => return,
        };
        self.seen.add_within(now, seconds(value), &self.limits);
    }

    /// What the cycle that began last measures at least, if nothing has come of it until `now`: one
    /// that hangs would else pass for none at all \[s\].
    fn at_least(&self, now: SimTime) -> Option<f64> {
        let lasted = now.checked_since(self.last_begin?)?;
        let at_least = match self.measure {
            TimingMeasure::Latency if !self.running => return None,
            TimingMeasure::Latency | TimingMeasure::LongestCycle => lasted,
            TimingMeasure::Jitter => self.jitter.at_least(now)?,
            TimingMeasure::DeadlineMisses | TimingMeasure::CycleRate | TimingMeasure::HalfRange => {
                return None;
            }
        };
        Some(seconds(at_least))
    }

    /// What was found in a window that ends at `end`.
    pub fn finding(&self, end: SimTime) -> Finding {
        let (Some(first), Some(last)) = (self.first_begin, self.last_begin) else {
            return Finding::unobserved("no cycle began in its time");
        };
        let finding = match self.measure {
            TimingMeasure::Jitter | TimingMeasure::Latency | TimingMeasure::LongestCycle => {
                let mut seen = self.seen;
                // A cycle that is still due at the end counts where it is the worst: any other is
                // merely not over.
                if let Some(at_least) = self.at_least(end).filter(|it| *it > seen.greatest) {
                    seen.add_within(end, at_least, &self.limits);
                }
                seen.finding(&self.limits, "")
            }
            TimingMeasure::HalfRange => self.half_range(last, end),
            TimingMeasure::DeadlineMisses => {
                let missed = self.missed as f64;
                let detail = format!("of {} cycles", self.begins + self.missed);
                Finding::of(self.limits.compare(missed, missed), self.first_miss, detail)
            }
            TimingMeasure::CycleRate => self.rate(first, last, end),
        };
        // A cycle that is missed is evidence against the measure, and none for it.
        let observed = match finding.verdict {
            Verdict::Fail => self.begins + self.missed,
            _ => self.begins,
        };
        finding.of_few(observed, LEAST_BEGINS, "cycles began")
    }

    fn half_range(&self, last: SimTime, end: SimTime) -> Finding {
        let Some((shortest, longest)) = self.between else {
            return Finding::unobserved("there was one cycle");
        };
        let longest = end
            .checked_since(last)
            .map_or(longest, |due| longest.max(due));
        let half = seconds(longest - shortest) / 2.0;
        let detail = format!("from {shortest} to {longest}");
        Finding::of(self.limits.compare(half, half), None, detail)
    }

    fn rate(&self, first: SimTime, last: SimTime, end: SimTime) -> Finding {
        let mut seen = self.last_missed.map_or(last, |missed| missed.max(last));
        // Cycles that have ceased are missing up to the end.
        let longest = self
            .between
            .map_or(SimDuration::ZERO, |(_, longest)| longest);
        if end.checked_since(last).is_some_and(|due| due > longest * 2) {
            seen = seen.max(end);
        }
        if seen == first {
            return Finding::unobserved("there was one cycle");
        }
        let rate = (self.begins - 1) as f64 / seconds(seen - first);
        Finding::of(self.limits.compare(rate, rate), None, "")
    }
}
