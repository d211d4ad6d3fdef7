use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, Unit};

use crate::interval_histogram::{IntervalHistogram, Percentile};
use crate::phase::Phase;

/// When something that repeats happened: cycles of the host, requests at a board.
///
/// Every interval from one event to the next counts, however long. What [`EventTiming::DIAGNOSTICS`] are, of n events:
///
/// | gauge | is |
/// |---|---|
/// | `mean` | (last − first) / (n − 1): its inverse is the rate of the events |
/// | `shortest`, `longest` | of the intervals, exact |
/// | `half_range` | half of longest less shortest |
/// | `p50`, `p99`, `p999` | percentiles of the intervals, nearest rank, to 1/128 (see [`IntervalHistogram`]) |
/// | `phase/deviation` | standard deviation of the events against the even grid of the nominal period, modulo that period; where there is none, against the even grid that fits best (see [`Phase`]) |
/// | `deviation` | the same, by its older name |
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct EventTiming {
    first_ns: u64,
    last_ns: Option<u64>,
    shortest_ns: u64,
    longest_ns: u64,
    intervals: IntervalHistogram,
    phase: Phase,
}

impl EventTiming {
    /// Names of what is told, all in seconds.
    pub(crate) const DIAGNOSTICS: [&str; 9] = [
        "mean",
        "shortest",
        "longest",
        "half_range",
        "p50",
        "p99",
        "p999",
        "phase/deviation",
        "deviation",
    ];

    /// Of events whose nominal period is that, or that have none.
    pub(crate) fn of(nominal: Option<Duration>) -> Self {
        let nanos = |period: Duration| u64::try_from(period.as_nanos()).unwrap_or(u64::MAX);
        Self {
            first_ns: 0,
            last_ns: None,
            shortest_ns: 0,
            longest_ns: 0,
            intervals: IntervalHistogram::default(),
            phase: Phase::of(nominal.map(nanos)),
        }
    }

    /// It happens, so many nanoseconds after the start of whatever clock; not before the last one.
    pub(crate) fn note(&mut self, at_ns: u64) {
        self.phase.note(at_ns);
        let Some(last) = self.last_ns.replace(at_ns) else {
            self.first_ns = at_ns;
            return;
        };
        let interval = at_ns.saturating_sub(last);
        if self.intervals.count() == 0 {
            self.shortest_ns = interval;
        }
        self.shortest_ns = self.shortest_ns.min(interval);
        self.longest_ns = self.longest_ns.max(interval);
        self.intervals.add(interval);
    }

    /// (last − first) / (n − 1) \[s\]; 0 before there is an interval.
    fn mean(&self) -> f64 {
        let span = self.last_ns.unwrap_or_default() - self.first_ns;
        span as f64 * 1e-9 / (self.intervals.count().max(1) as f64)
    }

    /// The gauges' ports, behind `prefix`.
    pub(crate) fn ports(prefix: &str) -> [Port; 9] {
        Self::DIAGNOSTICS.map(|name| Port::output(format!("{prefix}/{name}"), Unit::Second, 1))
    }

    /// Their values, in order.
    pub(crate) fn values(&self) -> [f64; 9] {
        let (shortest, longest) = (
            self.shortest_ns as f64 * 1e-9,
            self.longest_ns as f64 * 1e-9,
        );
        let [p50, p99, p999] = Percentile::ALL.map(|of| self.intervals.percentile(of) * 1e-9);
        let deviation = self.phase.deviation();
        [
            self.mean(),
            shortest,
            longest,
            0.5 * (longest - shortest),
            p50,
            p99,
            p999,
            deviation,
            deviation,
        ]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_kernel::Snapshot;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// By the definitions, from all events.
        #[test]
        fn every_statistic_is_that_of_all_intervals(
            intervals in prop::collection::vec(
                prop_oneof![20 => 1_900_000..2_100_000_u64, 1 => 0..40_000_000_u64], 1..2_000,
            ),
            start in 0..1_000_000_000_u64,
            cut in 0..2_000_usize,
        ) {
            let mut timing = EventTiming::of(Some(Duration::from_millis(2)));
            let mut at = start;
            timing.note(at);
            for (n, interval) in intervals.iter().enumerate() {
                at += interval;
                timing.note(at);
                if n == cut {
                    timing = Snapshot::of(&timing).read().unwrap();
                }
            }
            let mut sorted = intervals.clone();
            sorted.sort_unstable();
            let n = sorted.len();
            let (shortest, longest) = (sorted[0] as f64, sorted[n - 1] as f64);
            let rank = |per_mille: usize| sorted[(n * per_mille).div_ceil(1_000) - 1] as f64;
            let expected = [
                ((at - start) as f64 / n as f64, 1.0),
                (shortest, 1e-3),
                (longest, 1e-3),
                (0.5 * (longest - shortest), 1e-3),
                (rank(500), rank(500) / 128.0 + 8.0),
                (rank(990), rank(990) / 128.0 + 8.0),
                (rank(999), rank(999) / 128.0 + 8.0),
            ];
            for ((name, value), (exact, within)) in
                EventTiming::DIAGNOSTICS.into_iter().zip(timing.values()).zip(expected)
            {
                prop_assert!((value * 1e9 - exact).abs() <= within, "{name}: {value}, not {exact} ns");
            }
        }
    }

    /// A bus that slows down from 400 to 258 Hz does so in its mean, not at the place of a nominal grid.
    #[test]
    fn long_intervals_count_in_the_mean() {
        let mut timing = EventTiming::of(None);
        let mut at = 0;
        for n in 0..8_000 {
            timing.note(at);
            at += if n < 800 { 2_500_000 } else { 3_875_000 };
        }
        let [mean, ..] = timing.values();
        let exact = (800.0 * 2.5e-3 + 7_199.0 * 3.875e-3) / 7_999.0;
        assert!((mean - exact).abs() < 1e-12, "{mean}, not {exact}");
    }
}
