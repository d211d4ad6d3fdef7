//! Settling of values to their last ones.

use twinrig_kernel::SimTime;

use super::outcome::{Finding, Verdict};
use super::tracker::Extremes;
use crate::limits::Limits;

/// Settling of elements: their distances from their last values.
#[derive(Clone, Debug)]
pub(crate) struct Settling {
    within: f64,
    by: SimTime,
    elements: Vec<SettlingElement>,
}

#[derive(Clone, Debug)]
struct SettlingElement {
    element: usize,
    extremes: Extremes,
    last: f64,
    above: LaterMaxima,
    below: LaterMaxima,
}

/// Greatest number of stored maxima of one direction.
const STORED_MAX: usize = 128;

/// Samples that no later one exceeds: by time, with falling values. They answer when a signal last
/// exceeded a level that is known only at the end, as the band about the final value is.
///
/// Where there would be more than [`STORED_MAX`], time is divided into intervals, and of each the
/// first, greatest one is stored: it is above a level if any of its interval is, so that the answer
/// is early by less than an interval. The intervals are doubled when they are too many. Then
/// `STORED_MAX` of the former ones hold a sample, so that the new ones are shorter than 1/63 of the
/// time of the samples.
#[derive(Clone, Debug)]
struct LaterMaxima {
    stored: Vec<(SimTime, f64)>,
    /// Length of the intervals; zero while every sample is stored.
    interval: u64,
}

impl LaterMaxima {
    fn new() -> Self {
        LaterMaxima {
            stored: Vec::with_capacity(STORED_MAX),
            interval: 0,
        }
    }

    #[inline]
    fn add(&mut self, now: SimTime, value: f64) {
        while self.stored.last().is_some_and(|(_, last)| *last <= value) {
            self.stored.pop();
        }
        if self.stored.len() == STORED_MAX {
            self.lengthen_intervals();
        }
        let interval = self.interval;
        let is_of_last = |(last, _): &(SimTime, f64)| share_interval(*last, now, interval);
        if !self.stored.last().is_some_and(is_of_last) {
            self.stored.push((now, value));
        }
    }

    fn lengthen_intervals(&mut self) {
        let (Some((first, _)), Some((last, _))) = (self.stored.first(), self.stored.last()) else {
            return;
        };
        self.interval = match self.interval {
            0 => (last.as_nanos() - first.as_nanos()) / (STORED_MAX as u64 / 2),
            interval => interval.saturating_mul(2),
        };
        let interval = self.interval;
        // Removes an element that shares the interval of the one kept before it.
        self.stored
            .dedup_by(|(later, _), (kept, _)| share_interval(*kept, *later, interval));
    }

    /// Returns the last sample above a level.
    fn last_above(&self, level: f64) -> Option<(SimTime, f64)> {
        let count = self.stored.partition_point(|(_, value)| *value > level);
        self.stored[..count].last().copied()
    }
}

/// Returns whether two instants are in one interval of this length \[ns\].
#[inline]
fn share_interval(a: SimTime, b: SimTime, interval: u64) -> bool {
    interval > 0 && a.as_nanos() / interval == b.as_nanos() / interval
}

impl SettlingElement {
    #[inline]
    fn add(&mut self, now: SimTime, value: f64) {
        self.extremes.add_of(self.element, now, value);
        self.last = value;
        self.above.add(now, value);
        self.below.add(now, -value);
    }

    fn deviation(&self) -> f64 {
        let Extremes {
            least, greatest, ..
        } = self.extremes;
        (greatest - self.last).max(self.last - least)
    }

    /// Returns the last sample that is more than `within` from the final one.
    fn last_outside(&self, within: f64) -> Option<(SimTime, f64)> {
        let above = self.above.last_above(self.last + within);
        let below = self.below.last_above(within - self.last);
        let below = below.map(|(at, negated)| (at, -negated));
        above.into_iter().chain(below).max_by_key(|(at, _)| *at)
    }
}

impl Settling {
    /// Creates the statistics of these elements of the samples.
    pub fn new(within: f64, by: SimTime, elements: impl IntoIterator<Item = usize>) -> Self {
        let elements = elements.into_iter().map(|element| SettlingElement {
            element,
            extremes: Extremes::default(),
            last: f64::NAN,
            above: LaterMaxima::new(),
            below: LaterMaxima::new(),
        });
        Settling {
            within,
            by,
            elements: elements.collect(),
        }
    }

    /// Adds samples and returns whether they are at or after the settling time.
    #[inline]
    pub fn add(&mut self, now: SimTime, values: &[f64]) -> bool {
        if now < self.by {
            return false;
        }
        for element in &mut self.elements {
            element.add(now, values[element.element]);
        }
        true
    }

    pub fn finding(&self) -> Finding {
        let mut worst: Option<(f64, &SettlingElement)> = None;
        for element in &self.elements {
            if let Some(finding) = element.extremes.not_finite() {
                return finding;
            }
            if element.extremes.is_empty() {
                return Finding::unobserved("there is no observation in its window");
            }
            let deviation = element.deviation();
            if worst.is_none_or(|(greatest, _)| deviation > greatest) {
                worst = Some((deviation, element));
            }
        }
        let Some((worst, of)) = worst else {
            return Finding::unobserved("there is no signal");
        };
        let comparison = Limits::at_most(self.within).compare(worst, worst);
        let finding = Finding::of(comparison, None, "largest deviation from the final value");
        if finding.verdict == Verdict::Pass {
            return Finding {
                element: Some(of.element),
                ..finding
            };
        }
        let outside = self.elements.iter().filter_map(|element| {
            let (at, value) = element.last_outside(self.within)?;
            Some((at, value, element.element))
        });
        match outside.max_by_key(|(at, ..)| *at) {
            Some((at, value, element)) => Finding {
                detail: LAST_OUTSIDE.to_owned(),
                ..finding.seen_in(element, at, value)
            },
            None => finding,
        }
    }
}

/// Detail of a signal that has not settled.
pub(super) const LAST_OUTSIDE: &str = "last outside";

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn instant(index: usize) -> SimTime {
        SimTime::from_nanos(1_000_000 * (index as u64 + 1))
    }

    /// Returns the instant at which `values` are last outside, found and exact.
    fn last_outside(values: &[f64], within: f64) -> (Finding, Option<SimTime>) {
        let mut settling = Settling::new(within, SimTime::ZERO, [0]);
        for (index, value) in values.iter().enumerate() {
            settling.add(instant(index), &[*value]);
        }
        let last = values[values.len() - 1];
        let is_outside = |value: &f64| value - last > within || last - value > within;
        let exact = values.iter().rposition(is_outside).map(instant);
        (settling.finding(), exact)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn last_instant_outside_is_that_of_the_whole_signal(
            values in prop::collection::vec(-1.0..1.0_f64, 2..200),
            within in 0.05..0.5_f64,
        ) {
            let (found, exact) = last_outside(&values, within);
            prop_assert_eq!(found.verdict == Verdict::Fail, exact.is_some());
            if exact.is_some() {
                prop_assert_eq!(found.witness.at, exact);
            }
        }

        /// Falling signals with bumps, of whose samples only a part is stored.
        #[test]
        fn last_instant_outside_is_early_by_less_than_a_63rd_of_the_time(
            bumps in prop::collection::vec(0.0..0.01_f64, 1_000..5_000),
            decay in 0.1..5.0_f64,
            within in 0.001..0.9_f64,
        ) {
            let count = bumps.len() as f64;
            let fall = |(index, bump): (usize, &f64)| {
                libm::exp(-decay * index as f64 / count) + bump
            };
            let values: Vec<f64> = bumps.iter().enumerate().map(fall).collect();
            let (found, exact) = last_outside(&values, within);
            prop_assert_eq!(found.verdict == Verdict::Fail, exact.is_some());
            if let (Some(found), Some(exact)) = (found.witness.at, exact) {
                let early = exact - found;
                prop_assert!(early.as_secs_f64() < count * 1e-3 / 63.0, "{early}");
            }
        }
    }
}
