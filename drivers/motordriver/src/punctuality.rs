use libm::rint;
use serde::{Deserialize, Serialize};

/// How evenly something comes: the standard deviation of its arrivals against the even grid that
/// fits them best (least squares over all of them), and the shortest and longest interval.
///
/// A gap of several periods takes as many places of the grid, so that what is lost does not count as late.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Punctuality {
    last: Option<u64>,
    /// Intervals so far, and what they add up to \[ns\].
    intervals: u64,
    total_ns: u64,
    shortest_ns: u64,
    longest_ns: u64,
    /// The arrivals on the grid: their number, place and time after the first [ns], as means and second moments.
    count: f64,
    place: f64,
    mean_place: f64,
    mean_ns: f64,
    sum_place_place: f64,
    sum_place_ns: f64,
    sum_ns_ns: f64,
    first: u64,
    /// Interval that times are told against, to keep digits: the first one \[ns\].
    nominal_ns: u64,
}

impl Punctuality {
    /// It has come, so many nanoseconds after the start of whatever clock; not before the last one.
    pub(crate) fn note(&mut self, at: u64) {
        let Some(last) = self.last.replace(at) else {
            self.first = at;
            self.moments(0.0);
            return;
        };
        let interval = at.saturating_sub(last);
        let periods = if self.intervals == 0 {
            self.shortest_ns = interval;
            self.nominal_ns = interval;
            1.0
        } else {
            let mean = self.total_ns as f64 / self.intervals as f64;
            rint(interval as f64 / mean).max(1.0)
        };
        self.shortest_ns = self.shortest_ns.min(interval);
        self.longest_ns = self.longest_ns.max(interval);
        if periods == 1.0 {
            self.intervals += 1;
            self.total_ns += interval;
        }
        self.place += periods;
        // Both are far below 2^53, so that the difference is exact.
        let nominal = self.place * self.nominal_ns as f64;
        self.moments(at.saturating_sub(self.first) as f64 - nominal);
    }

    fn moments(&mut self, ns: f64) {
        self.count += 1.0;
        let (place, time) = (self.place - self.mean_place, ns - self.mean_ns);
        self.mean_place += place / self.count;
        self.mean_ns += time / self.count;
        let late = ns - self.mean_ns;
        self.sum_place_place += place * (self.place - self.mean_place);
        self.sum_place_ns += place * late;
        self.sum_ns_ns += time * late;
    }

    /// Standard deviation against the even grid that fits best \[s\].
    pub(crate) fn deviation(&self) -> f64 {
        if self.count < 3.0 || self.sum_place_place == 0.0 {
            return 0.0;
        }
        let explained = self.sum_place_ns * (self.sum_place_ns / self.sum_place_place);
        ((self.sum_ns_ns - explained).max(0.0) / self.count).sqrt() * 1e-9
    }

    /// Shortest interval \[s\]; 0 before there is one.
    pub(crate) fn shortest(&self) -> f64 {
        self.shortest_ns as f64 * 1e-9
    }

    /// Longest interval \[s\].
    pub(crate) fn longest(&self) -> f64 {
        self.longest_ns as f64 * 1e-9
    }

    /// Mean of the intervals of a single period \[s\]; 0 before there is one.
    pub(crate) fn mean(&self) -> f64 {
        self.total_ns as f64 * 1e-9 / (self.intervals.max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn noted(times_ns: impl IntoIterator<Item = u64>) -> Punctuality {
        let mut punctuality = Punctuality::default();
        for at in times_ns {
            punctuality.note(at);
        }
        punctuality
    }

    #[test]
    fn an_even_grid_has_no_deviation_even_with_gaps() {
        let times = (0..1_000_000_u64).filter(|n| n % 1_000 != 7);
        let punctuality = noted(times.map(|n| 5_000 + n * 2_000_123));
        assert!(punctuality.deviation() < 1e-12, "{punctuality:?}");
        assert_eq!(punctuality.longest(), 4_000_246.0 * 1e-9);
    }

    proptest! {
        /// Uniform jitter of a width has the standard deviation width/√12.
        #[test]
        fn jitter_shows_as_its_standard_deviation(width in 100_u64..500_000, seed in any::<u64>()) {
            let mut random = twinrig_kernel::stream(seed, "jitter");
            let times: Vec<u64> = (0..20_000).map(|n| n * 2_000_000 + random.between(0, width)).collect();
            let punctuality = noted(times);
            let expected = 1e-9 * width as f64 / 12.0_f64.sqrt();
            prop_assert!((punctuality.deviation() / expected - 1.0).abs() < 0.05);
            prop_assert!(punctuality.shortest() <= punctuality.mean());
            prop_assert!(punctuality.mean() <= punctuality.longest());
        }
    }
}
