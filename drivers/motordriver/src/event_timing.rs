use std::time::Duration;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, Unit};

use crate::interval_histogram::{IntervalHistogram, Percentile};
use crate::phase::Phase;

/// Statistics of the instants of a repeated event: cycles of the host, requests at a board.
///
/// Every interval between consecutive events counts, however long. Definition of
/// [`EventTiming::DIAGNOSTICS`] for n events:
///
/// | diagnostic | definition |
/// |---|---|
/// | `mean` | (last − first) / (n − 1), the inverse of the rate |
/// | `shortest`, `longest` | of the intervals, exact |
/// | `half_range` | half of longest minus shortest |
/// | `p50`, `p99`, `p999` | percentiles of the intervals (see [`IntervalHistogram`]) |
/// | `phase/deviation` | standard deviation from an even grid (see [`Phase`]) |
/// | `deviation` | alias of `phase/deviation` |
///
/// Percentiles are those of the nearest rank, to 1/128. The grid is that of the nominal period,
/// modulo that period; without a nominal period it is the even grid that fits the events best.
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
    /// Names of the statistics, all in seconds.
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

    /// Creates the statistics of events with or without a nominal period.
    pub(crate) fn new(nominal: Option<Duration>) -> Self {
        let nanos = |period: Duration| u64::try_from(period.as_nanos()).unwrap_or(u64::MAX);
        Self {
            first_ns: 0,
            last_ns: None,
            shortest_ns: 0,
            longest_ns: 0,
            intervals: IntervalHistogram::default(),
            phase: Phase::new(nominal.map(nanos)),
        }
    }

    /// Records an event at `at_ns` nanoseconds of any clock, not before the last one.
    pub(crate) fn record(&mut self, at_ns: u64) {
        self.phase.record(at_ns);
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

    /// Returns (last − first) / (n − 1) \[s\]; 0 before the first interval.
    fn mean(&self) -> f64 {
        let span = self.last_ns.unwrap_or_default() - self.first_ns;
        span as f64 * 1e-9 / (self.intervals.count().max(1) as f64)
    }

    /// Returns the mean interval \[ns\]; 0 before the second event.
    pub(crate) fn mean_ns(&self) -> u64 {
        let span = self.last_ns.unwrap_or_default() - self.first_ns;
        span / self.intervals.count().max(1)
    }

    /// Returns the ports of the diagnostics, behind `prefix`.
    pub(crate) fn ports(prefix: &str) -> [Port; 9] {
        Self::DIAGNOSTICS.map(|name| Port::output(format!("{prefix}/{name}"), Unit::Second, 1))
    }

    /// Returns the values of the diagnostics, in order.
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
        /// Compares with the definitions, evaluated on all events.
        #[test]
        fn statistics_match_their_definitions(
            intervals in prop::collection::vec(
                prop_oneof![20 => 1_900_000..2_100_000_u64, 1 => 0..40_000_000_u64], 1..2_000,
            ),
            start in 0..1_000_000_000_u64,
            cut in 0..2_000_usize,
        ) {
            let mut timing = EventTiming::new(Some(Duration::from_millis(2)));
            let mut at = start;
            timing.record(at);
            for (n, interval) in intervals.iter().enumerate() {
                at += interval;
                timing.record(at);
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

    /// Case of a bus that slows down from 400 to 258 Hz.
    #[test]
    fn mean_includes_long_intervals() {
        let mut timing = EventTiming::new(None);
        let mut at = 0;
        for n in 0..8_000 {
            timing.record(at);
            at += if n < 800 { 2_500_000 } else { 3_875_000 };
        }
        let [mean, ..] = timing.values();
        let exact = (800.0 * 2.5e-3 + 7_199.0 * 3.875e-3) / 7_999.0;
        assert!((mean - exact).abs() < 1e-12, "{mean}, not {exact}");
    }
}
