//! Search for the largest stable step.

use twinrig_kernel::SimDuration;

/// Result of a run at one step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Probe {
    Stable,
    Unstable(String),
    /// The plant reported a fault, under error control.
    Refused(String),
    /// The run gave no answer.
    Unknown(String),
    /// The run exceeded its budget.
    OverBudget(String),
}

/// Result of a search.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SearchResult {
    /// Largest step found stable, if any.
    pub(crate) stable: Option<SimDuration>,
    /// Smallest step found unstable, if any.
    pub(crate) unstable: Option<SimDuration>,
    /// Reason of the instability.
    pub(crate) why: Option<String>,
    /// Reason of an early end.
    pub(crate) cut: Option<String>,
    /// The early end was due to the budget.
    pub(crate) slow: bool,
    pub(crate) probes: u64,
}

/// Range and resolution of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    pub(crate) least: SimDuration,
    pub(crate) most: SimDuration,
    /// The search ends when the smallest unstable step is at most this multiple of the largest
    /// stable one.
    pub(crate) ratio: f64,
}

/// Fractions of the limit that must be stable, too: an island of stability is not the limit.
const CHECKED_BELOW: [f64; 2] = [0.8, 0.5];

/// Divisor of the step while no stable step is known.
const DESCENT: u64 = 10;

/// Finds the largest stable step by bisection of its logarithm.
pub(crate) fn search(range: Range, mut probe: impl FnMut(SimDuration) -> Probe) -> SearchResult {
    let mut found = SearchResult::default();
    let mut high = range.most;
    loop {
        found.bisect(range, high, &mut probe);
        let (None, Some(limit)) = (&found.cut, found.stable) else {
            return found;
        };
        let below = CHECKED_BELOW.map(|share| scaled(limit, share));
        let shorter = below.into_iter().filter(|&step| step >= range.least);
        let refuted = shorter.into_iter().find(|&step| {
            found.probes += 1;
            match probe(step) {
                Probe::Unstable(why) | Probe::Refused(why) => {
                    found.why = Some(why);
                    true
                }
                Probe::Unknown(why) => {
                    found.cut = Some(why);
                    false
                }
                Probe::OverBudget(why) => {
                    (found.cut, found.slow) = (Some(why), true);
                    false
                }
                Probe::Stable => false,
            }
        });
        match refuted {
            None => return found,
            Some(step) => {
                found.stable = None;
                found.unstable = Some(step);
                high = step;
            }
        }
    }
}

impl SearchResult {
    /// Bisects between the least step and `high`, which is known to be unstable if `unstable`
    /// equals it.
    fn bisect(
        &mut self,
        range: Range,
        high: SimDuration,
        probe: &mut impl FnMut(SimDuration) -> Probe,
    ) {
        if self.unstable != Some(high) && !self.probe_step(high, probe) {
            return;
        }
        // Large reductions: unstable runs end early, and stable ones are the cheaper the longer the
        // step.
        let mut low = high;
        while self.stable.is_none() && low > range.least {
            low = (low / DESCENT).max(range.least);
            if !self.probe_step(low, probe) {
                return;
            }
        }
        while let (Some(stable), Some(unstable)) = (self.stable, self.unstable) {
            let (low, high) = (stable.as_secs_f64(), unstable.as_secs_f64());
            if high <= low * range.ratio {
                return;
            }
            let Some(middle) = SimDuration::try_from_secs_f64((low * high).sqrt()) else {
                return;
            };
            // Steps are whole nanoseconds.
            if middle <= stable || middle >= unstable || !self.probe_step(middle, probe) {
                return;
            }
        }
    }

    /// Probes a step; returns false if the probe gave no answer.
    fn probe_step(
        &mut self,
        step: SimDuration,
        probe: &mut impl FnMut(SimDuration) -> Probe,
    ) -> bool {
        self.probes += 1;
        match probe(step) {
            Probe::Stable => self.stable = Some(step),
            Probe::Unstable(why) | Probe::Refused(why) => {
                self.unstable = Some(step);
                self.why = Some(why);
            }
            Probe::Unknown(why) => {
                self.cut = Some(why);
                return false;
            }
            Probe::OverBudget(why) => {
                (self.cut, self.slow) = (Some(why), true);
                return false;
            }
        }
        true
    }
}

fn scaled(step: SimDuration, share: f64) -> SimDuration {
    // A fraction of a duration is representable.
    SimDuration::try_from_secs_f64(step.as_secs_f64() * share).unwrap_or(step)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RANGE: Range = Range {
        least: SimDuration::from_micros(1),
        most: SimDuration::from_millis(100),
        ratio: 1.05,
    };

    fn limit_at(limit_ns: u64) -> impl FnMut(SimDuration) -> Probe {
        move |step| {
            if step.as_nanos() <= limit_ns {
                Probe::Stable
            } else {
                Probe::Unstable(String::new())
            }
        }
    }

    proptest! {
        #[test]
        fn limit_lies_between_stable_and_unstable_step(
            limit_ns in 1_000_u64..100_000_000
        ) {
            let found = search(RANGE, limit_at(limit_ns));
            let (stable, unstable) = (found.stable.unwrap(), found.unstable.unwrap());
            prop_assert!(stable.as_nanos() <= limit_ns && limit_ns < unstable.as_nanos());
            prop_assert!(unstable.as_secs_f64() <= 1.05 * stable.as_secs_f64() + 2e-9);
            prop_assert!(found.probes < 20);
        }
    }

    #[test]
    fn limits_outside_of_the_range_are_reported() {
        let all = search(RANGE, limit_at(u64::MAX));
        assert_eq!(
            (all.stable, all.unstable, all.probes),
            (Some(RANGE.most), None, 3)
        );
        let none = search(RANGE, limit_at(10));
        assert_eq!(
            (none.stable, none.unstable, none.probes),
            (None, Some(RANGE.least), 6)
        );
    }

    #[test]
    fn an_island_of_stability_is_not_the_limit() {
        // Stable up to 1 ms, and in an island within the range or at its end.
        for island in [5000..=9000, 70_000..=100_000] {
            let found = search(RANGE, |step| {
                let micros = step.as_nanos() / 1000;
                if micros <= 1000 || island.contains(&micros) {
                    Probe::Stable
                } else {
                    Probe::Unstable("outside".to_owned())
                }
            });
            let limit = found.stable.unwrap().as_nanos();
            assert!((950_000..=1_001_000).contains(&limit), "{limit}");
        }
    }

    #[test]
    fn unanswered_probe_ends_the_search_and_keeps_the_bounds() {
        let mut left = 3;
        let found = search(RANGE, |step| {
            left -= 1;
            if left < 0 {
                return Probe::OverBudget("too slow".to_owned());
            }
            limit_at(2_000_000)(step)
        });
        assert_eq!((found.cut.as_deref(), found.slow), (Some("too slow"), true));
        assert!(found.stable < found.unstable);
    }
}
