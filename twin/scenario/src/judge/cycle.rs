//! Watching a cycle: iterations of the controller, or transfers of a bus.

use twinrig_kernel::{CycleJitter, SimDuration, SimTime};

use super::Happening;
use super::outcome::Finding;
use super::tracker::Extremes;
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
    /// Jitter, latency or time between two begins \[s\].
    seen: Extremes,
    /// Shortest and longest time between two begins.
    between: Option<(SimDuration, SimDuration)>,
    first_miss: Option<SimTime>,
    last_missed: Option<SimTime>,
}

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
            seen: Extremes::default(),
            between: None,
            first_miss: None,
            last_missed: None,
        }
    }

    pub fn event(&mut self, now: SimTime, happening: Happening) {
        match happening {
            Happening::CycleBegin => {
                let jitter = self.jitter.begin(now);
                if let (Some(last), Some(jitter)) = (self.last_begin, jitter) {
                    self.begun_again(now, now - last, jitter);
                }
                self.first_begin.get_or_insert(now);
                self.last_begin = Some(now);
                self.begins += 1;
            }
            Happening::CycleEnd => {
                if let (TimingMeasure::Latency, Some(begin)) = (self.measure, self.last_begin) {
                    let latency = (now - begin).as_secs_f64();
                    self.seen.add_within(now, latency, &self.limits);
                }
            }
            Happening::CycleMissed => {
                self.missed += 1;
                let missed = self.missed as f64;
                if self.first_miss.is_none() && !self.limits.hold(missed) {
                    self.first_miss = Some(now);
                }
                self.last_missed = Some(now);
                self.still_running(now);
            }
        }
    }

    fn begun_again(&mut self, now: SimTime, between: SimDuration, jitter: SimDuration) {
        match self.measure {
            TimingMeasure::Jitter => {
                self.seen
                    .add_within(now, jitter.as_secs_f64(), &self.limits);
            }
            TimingMeasure::LongestCycle => {
                self.seen
                    .add_within(now, between.as_secs_f64(), &self.limits);
            }
            TimingMeasure::HalfRange => {
                let (shortest, longest) = self.between.unwrap_or((between, between));
                self.between = Some((shortest.min(between), longest.max(between)));
            }
            TimingMeasure::DeadlineMisses | TimingMeasure::CycleRate | TimingMeasure::Latency => {}
        }
    }

    /// A cycle that does not end is at least as long as it has been: one that hangs would else pass for none at all.
    fn still_running(&mut self, now: SimTime) {
        let Some(begin) = self.last_begin else { return };
        let lasted = now - begin;
        let at_least = match self.measure {
            TimingMeasure::Latency | TimingMeasure::LongestCycle => lasted,
            TimingMeasure::Jitter => self.jitter.at_least(now).unwrap_or_default(),
            TimingMeasure::DeadlineMisses | TimingMeasure::CycleRate | TimingMeasure::HalfRange => {
                return;
            }
        };
        self.seen
            .add_within(now, at_least.as_secs_f64(), &self.limits);
    }

    pub fn finding(&self) -> Finding {
        let (Some(first), Some(last)) = (self.first_begin, self.last_begin) else {
            return Finding::unobserved("no cycle began in its time");
        };
        match self.measure {
            TimingMeasure::Jitter | TimingMeasure::Latency | TimingMeasure::LongestCycle => {
                self.seen.finding(&self.limits, "")
            }
            TimingMeasure::HalfRange => match self.between {
                Some((shortest, longest)) => {
                    let half = (longest - shortest).as_secs_f64() / 2.0;
                    let detail = format!("from {shortest} to {longest}");
                    Finding::of(self.limits.compare(half, half), None, detail)
                }
                None => Finding::unobserved("there was one cycle"),
            },
            TimingMeasure::DeadlineMisses => {
                let missed = self.missed as f64;
                let detail = format!("of {} cycles", self.begins + self.missed);
                Finding::of(self.limits.compare(missed, missed), self.first_miss, detail)
            }
            TimingMeasure::CycleRate
                if self.last_missed.map_or(last, |missed| missed.max(last)) > first =>
            {
                let seen = self.last_missed.map_or(last, |missed| missed.max(last));
                let rate = (self.begins - 1) as f64 / (seen - first).as_secs_f64();
                Finding::of(self.limits.compare(rate, rate), None, "")
            }
            TimingMeasure::CycleRate => Finding::unobserved("there was one cycle"),
        }
    }
}
