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
/// Where there would be more than [`STORED_MAX`], those are dropped that follow another one within
/// 1/64 of the stored time. Repeated, that makes the instant up to 1/16 of it too early.
#[derive(Clone, Debug)]
struct LaterMaxima(Vec<(SimTime, f64)>);

impl LaterMaxima {
    fn new() -> Self {
        LaterMaxima(Vec::with_capacity(STORED_MAX))
    }

    #[inline]
    fn add(&mut self, now: SimTime, value: f64) {
        while self.0.last().is_some_and(|(_, last)| *last <= value) {
            self.0.pop();
        }
        if self.0.len() == STORED_MAX {
            self.thin_out();
        }
        self.0.push((now, value));
    }

    fn thin_out(&mut self) {
        let (Some((first, _)), Some((last, _))) = (self.0.first(), self.0.last()) else {
            return;
        };
        let gap = (*last - *first) / (STORED_MAX as u64 / 2);
        let mut kept: Option<SimTime> = None;
        self.0.retain(|(at, _)| {
            let keeps = kept.is_none_or(|kept| *at - kept >= gap);
            if keeps {
                kept = Some(*at);
            }
            keeps
        });
    }

    /// Returns the last sample above a level.
    fn last_above(&self, level: f64) -> Option<(SimTime, f64)> {
        let count = self.0.partition_point(|(_, value)| *value > level);
        self.0[..count].last().copied()
    }
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

    proptest! {
        /// The stored samples give the same answer as all of them.
        #[test]
        fn last_instant_outside_is_that_of_the_whole_signal(
            values in prop::collection::vec(-1.0..1.0_f64, 2..200),
            within in 0.05..0.5_f64,
        ) {
            let mut settling = Settling::new(within, SimTime::ZERO, [0]);
            for (index, value) in values.iter().enumerate() {
                settling.add(instant(index), &[*value]);
            }
            let last = values[values.len() - 1];
            let outside = values.iter().rposition(|value| {
                value - last > within || last - value > within
            });
            let found = settling.finding();
            let expected = outside.map(instant);
            prop_assert_eq!(found.verdict == Verdict::Fail, expected.is_some());
            if expected.is_some() {
                prop_assert_eq!(found.witness.at, expected);
            }
        }
    }

    #[test]
    fn falling_signal_longer_than_the_store_is_resolved_to_a_share_of_its_time() {
        let count = 100 * STORED_MAX;
        let mut settling = Settling::new(0.25, SimTime::ZERO, [0]);
        for index in 0..=count {
            settling.add(instant(index), &[1.0 - index as f64 / count as f64]);
        }
        // It is last outside at 3/4 of its way.
        let at = settling.finding().witness.at.unwrap();
        let share = at.since_start().as_secs_f64() / instant(count).since_start().as_secs_f64();
        assert!((0.75 - 1.0 / 16.0..=0.75).contains(&share), "{share}");
    }
}
