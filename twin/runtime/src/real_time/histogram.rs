use std::fmt;
use std::time::Duration;

/// Histogram of durations with bucket bounds in the ratio 1 : 2 : 5 from 1 µs to 1 s, so that rare
/// long durations are visible beside many short ones. Fixed size; counting takes constant time.
///
/// ```
/// use std::time::Duration;
/// use twinrig_runtime::real_time::Histogram;
///
/// let mut lateness = Histogram::default();
/// for micros in [3, 4, 4, 70] {
///     lateness.count(Duration::from_micros(micros));
/// }
/// assert_eq!((lateness.len(), lateness.longest()), (4, Duration::from_micros(70)));
/// assert_eq!(lateness.at_most(0.75), Some(Duration::from_micros(5)));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Histogram {
    /// One bucket more than there are bounds: the last is for durations above all bounds.
    buckets: [u64; BOUNDS_NS.len() + 1],
    count: u64,
    sum_ns: u128,
    longest_ns: u64,
}

/// Upper ends of the buckets, included \[ns\].
const BOUNDS_NS: [u64; 19] = [
    1_000,
    2_000,
    5_000,
    10_000,
    20_000,
    50_000,
    100_000,
    200_000,
    500_000,
    1_000_000,
    2_000_000,
    5_000_000,
    10_000_000,
    20_000_000,
    50_000_000,
    100_000_000,
    200_000_000,
    500_000_000,
    1_000_000_000,
];

/// Length of the longest bar \[characters\].
const BAR: u64 = 40;

impl Histogram {
    /// Counts a duration.
    pub fn count(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.buckets[BOUNDS_NS.partition_point(|bound| *bound < ns)] += 1;
        self.count += 1;
        self.sum_ns += u128::from(ns);
        self.longest_ns = self.longest_ns.max(ns);
    }

    /// Returns the number of durations counted.
    pub fn len(&self) -> u64 {
        self.count
    }

    /// Returns whether no duration was counted.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the exact maximum; zero if empty.
    pub fn longest(&self) -> Duration {
        Duration::from_nanos(self.longest_ns)
    }

    /// Returns the exact mean; zero if empty.
    pub fn mean(&self) -> Duration {
        let mean = self.sum_ns / u128::from(self.count.max(1));
        Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX))
    }

    /// Returns the quantile of `share` (0 to 1), rounded up to the bound of its bucket; none if
    /// empty.
    pub fn at_most(&self, share: f64) -> Option<Duration> {
        let mut cumulative = 0;
        let target = share * self.count as f64;
        let bucket = self.buckets.iter().position(|count| {
            cumulative += count;
            cumulative > 0 && cumulative as f64 >= target
        })?;
        let bound = BOUNDS_NS.get(bucket).copied().unwrap_or(u64::MAX);
        Some(Duration::from_nanos(bound.min(self.longest_ns)))
    }

    /// Returns the buckets in increasing order: upper bound (none for the last), and count.
    pub fn buckets(&self) -> impl Iterator<Item = (Option<Duration>, u64)> {
        let bounds = BOUNDS_NS.iter().map(|&ns| Some(Duration::from_nanos(ns)));
        bounds.chain([None]).zip(self.buckets)
    }
}

/// A line per bucket, from the first to the last that is not empty, and one with mean and maximum.
impl fmt::Display for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_filled = |(_, count): &(Option<Duration>, u64)| *count > 0;
        let skip = self
            .buckets()
            .position(|bucket| is_filled(&bucket))
            .unwrap_or(0);
        let rows: Vec<_> = self.buckets().skip(skip).collect();
        let last = rows.iter().rposition(is_filled).map_or(0, |last| last + 1);
        let peak = self.buckets.iter().max().copied().unwrap_or(0).max(1);
        for (end, count) in &rows[..last] {
            let end = end.map_or_else(|| "longer".into(), |end| format!("≤ {end:?}"));
            // A bucket that is not empty has a bar of at least one character.
            let bar = (count * BAR).div_ceil(peak);
            let bar = "#".repeat(usize::try_from(bar).unwrap_or_default());
            writeln!(f, "{end:>8} {count:>9} {bar}")?;
        }
        let (mean, longest) = (self.mean(), self.longest());
        write!(
            f,
            "    mean {mean:.1?}, longest {longest:.1?}, of {}",
            self.count
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rare_long_durations_are_visible_beside_many_short_ones() {
        let mut histogram = Histogram::default();
        for _ in 0..900 {
            histogram.count(Duration::from_micros(4));
        }
        for _ in 0..100 {
            histogram.count(Duration::from_micros(40));
        }
        histogram.count(Duration::from_secs(3));
        let text = histogram.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            format!("{:>8} {:>9} {}", "≤ 5µs", 900, "#".repeat(40))
        );
        assert_eq!(lines[3], format!("{:>8} {:>9} {}", "≤ 50µs", 100, "#####"));
        assert_eq!(lines[lines.len() - 2], "  longer         1 #");
        assert_eq!(histogram.at_most(0.9), Some(Duration::from_micros(50)));
        assert_eq!(histogram.at_most(0.5), Some(Duration::from_micros(5)));
        assert_eq!(histogram.at_most(1.0), Some(Duration::from_secs(3)));
        let sum: u64 = histogram.buckets().map(|(_, count)| count).sum();
        assert_eq!(sum, histogram.len());
    }

    #[test]
    fn empty_histogram_has_no_buckets() {
        let empty = Histogram::default();
        assert_eq!((empty.at_most(0.5), empty.mean()), (None, Duration::ZERO));
        assert_eq!(empty.to_string().lines().count(), 1);
    }
}
