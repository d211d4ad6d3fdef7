//! Statistics of a cycle: iterations of the controller, or transfers of a bus.

use twinrig_kernel::{CycleJitter, SimDuration, SimTime};

use super::CycleEvent;
use super::outcome::{Finding, Verdict};
use super::tracker::{Extremes, seconds};
use crate::expect::TimingMeasure;
use crate::limits::Limits;

/// Statistics of the events of one cycle.
#[derive(Clone, Debug)]
pub(crate) struct CycleMeter {
    measure: TimingMeasure,
    limits: Limits,
    jitter: CycleJitter,
    first_begin: Option<SimTime>,
    last_begin: Option<SimTime>,
    begins: u64,
    missed: u64,
    /// Transfers of buses that had not ended at a cycle of the controller.
    skipped: u64,
    /// Whether the last cycle that began has not ended.
    running: bool,
    /// Jitter, latency or interval between two cycle starts \[s\].
    extremes: Extremes,
    /// Shortest and longest interval between two cycle starts.
    intervals: Option<(SimDuration, SimDuration)>,
    first_miss: Option<SimTime>,
    last_missed: Option<SimTime>,
}

/// Least number of cycle starts for a verdict.
const MIN_BEGINS: u64 = 3;

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
            skipped: 0,
            running: false,
            extremes: Extremes::default(),
            intervals: None,
            first_miss: None,
            last_missed: None,
        }
    }

    pub fn event(&mut self, now: SimTime, event: CycleEvent) {
        match event {
            CycleEvent::Begin => {
                let jitter = self.jitter.begin(now);
                if let (Some(last), Some(jitter)) = (self.last_begin, jitter) {
                    self.record_interval(now, now - last, jitter);
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
                    self.extremes.add_within(now, latency, &self.limits);
                }
            }
            CycleEvent::Missed | CycleEvent::Waits => {
                if event == CycleEvent::Missed {
                    self.missed += 1;
                    self.count_miss(now);
                }
                self.last_missed = Some(now);
                if let Some(lower_bound) = self.lower_bound(now) {
                    self.extremes.add_within(now, lower_bound, &self.limits);
                }
            }
        }
    }

    /// Counts a transfer of a bus that has not ended at a cycle of the controller.
    pub fn skip(&mut self, now: SimTime) {
        self.skipped += 1;
        self.count_miss(now);
    }

    fn count_miss(&mut self, now: SimTime) {
        let missed = (self.missed + self.skipped) as f64;
        if self.first_miss.is_none() && !self.limits.hold(missed) {
            self.first_miss = Some(now);
        }
    }

    /// Returns whether it counts the deadlines that were missed.
    pub fn counts_misses(&self) -> bool {
        self.measure == TimingMeasure::DeadlineMisses
    }

    fn record_interval(&mut self, now: SimTime, interval: SimDuration, jitter: SimDuration) {
        let (shortest, longest) = self.intervals.unwrap_or((interval, interval));
        self.intervals = Some((shortest.min(interval), longest.max(interval)));
        let value = match self.measure {
            TimingMeasure::Jitter => jitter,
            TimingMeasure::LongestCycle => interval,
            TimingMeasure::DeadlineMisses
            | TimingMeasure::CycleRate
            | TimingMeasure::Latency
            | TimingMeasure::HalfRange => return,
        };
        self.extremes.add_within(now, seconds(value), &self.limits);
    }

    /// Returns a lower bound of the measure for the pending cycle at `now` \[s\], so that a hung
    /// cycle does not go unnoticed.
    fn lower_bound(&self, now: SimTime) -> Option<f64> {
        let elapsed = now.checked_since(self.last_begin?)?;
        let lower_bound = match self.measure {
            TimingMeasure::Latency if !self.running => return None,
            TimingMeasure::Latency | TimingMeasure::LongestCycle => elapsed,
            TimingMeasure::Jitter => self.jitter.at_least(now)?,
            TimingMeasure::DeadlineMisses | TimingMeasure::CycleRate | TimingMeasure::HalfRange => {
                return None;
            }
        };
        Some(seconds(lower_bound))
    }

    /// Returns the finding of a window that ends at `end`, in which buses missed so many deadlines.
    pub fn finding(&self, end: SimTime, of_buses: u64) -> Finding {
        let (Some(first), Some(last)) = (self.first_begin, self.last_begin) else {
            return Finding::unobserved("no cycle began in its time");
        };
        let finding = match self.measure {
            TimingMeasure::Jitter | TimingMeasure::Latency | TimingMeasure::LongestCycle => {
                let mut extremes = self.extremes;
                // A cycle that is pending at the end counts only if its lower bound is the worst
                // value.
                if let Some(lower_bound) =
                    self.lower_bound(end).filter(|it| *it > extremes.greatest)
                {
                    extremes.add_within(end, lower_bound, &self.limits);
                }
                extremes.finding(&self.limits, "")
            }
            TimingMeasure::HalfRange => self.half_range(last, end),
            TimingMeasure::DeadlineMisses => {
                let missed = (self.missed + self.skipped + of_buses) as f64;
                let mut detail = format!("of {} cycles", self.begins + self.missed);
                for (count, what) in [
                    (self.skipped, "transfers not done in time"),
                    (of_buses, "points and answers of buses"),
                ] {
                    if count > 0 {
                        detail = format!("{detail}, {count} {what}");
                    }
                }
                Finding::of(self.limits.compare(missed, missed), self.first_miss, detail)
            }
            TimingMeasure::CycleRate => self.rate(first, last, end),
        };
        // Missed cycles count as observations for a failure, but not for a pass.
        let observed = match finding.verdict {
            Verdict::Fail => self.begins + self.missed,
            _ => self.begins,
        };
        finding.require_count(observed, MIN_BEGINS, "cycles began")
    }

    fn half_range(&self, last: SimTime, end: SimTime) -> Finding {
        let Some((shortest, longest)) = self.intervals else {
            return Finding::unobserved("there was one cycle");
        };
        let longest = end
            .checked_since(last)
            .map_or(longest, |pending| longest.max(pending));
        let half = seconds(longest - shortest) / 2.0;
        let detail = format!("from {shortest} to {longest}");
        Finding::of(self.limits.compare(half, half), None, detail)
    }

    fn rate(&self, first: SimTime, last: SimTime, end: SimTime) -> Finding {
        let mut observed_until = self.last_missed.map_or(last, |missed| missed.max(last));
        // If cycles have stopped, those up to the end are missing.
        let longest = self
            .intervals
            .map_or(SimDuration::ZERO, |(_, longest)| longest);
        if end
            .checked_since(last)
            .is_some_and(|pending| pending > longest * 2)
        {
            observed_until = observed_until.max(end);
        }
        if observed_until == first {
            return Finding::unobserved("there was one cycle");
        }
        let rate = (self.begins - 1) as f64 / seconds(observed_until - first);
        Finding::of(self.limits.compare(rate, rate), None, "")
    }
}
