use std::fmt;
use std::time::Duration;

/// How often a duration was about how long: buckets in the ratio 1 : 2 : 5 from 1 µs to 1 s, so that rare
/// long ones show beside many short ones. Counting takes no memory and no time to speak of.
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
    /// One more than there are bounds: the last is for what is longer than all.
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
    /// Counts one.
    pub fn count(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.buckets[BOUNDS_NS.partition_point(|bound| *bound < ns)] += 1;
        self.count += 1;
        self.sum_ns += u128::from(ns);
        self.longest_ns = self.longest_ns.max(ns);
    }

    /// How many were counted.
    pub fn len(&self) -> u64 {
        self.count
    }

    /// Whether none was.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The longest, exactly; zero if there is none.
    pub fn longest(&self) -> Duration {
        Duration::from_nanos(self.longest_ns)
    }

    /// The mean, exactly; zero if there is none.
    pub fn mean(&self) -> Duration {
        let mean = self.sum_ns / u128::from(self.count.max(1));
        Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX))
    }

    /// What a `share` of them (0 to 1) was not longer than, to the end of its bucket; none if there are none.
    pub fn at_most(&self, share: f64) -> Option<Duration> {
        let mut seen = 0;
        let wanted = share * self.count as f64;
        let bucket = self.buckets.iter().position(|count| {
            seen += count;
            seen > 0 && seen as f64 >= wanted
        })?;
        let bound = BOUNDS_NS.get(bucket).copied().unwrap_or(u64::MAX);
        Some(Duration::from_nanos(bound.min(self.longest_ns)))
    }

    /// The buckets, shortest first: the end of each, none for what is past all, and how many it holds.
    pub fn buckets(&self) -> impl Iterator<Item = (Option<Duration>, u64)> {
        let ends = BOUNDS_NS.iter().map(|&ns| Some(Duration::from_nanos(ns)));
        ends.chain([None]).zip(self.buckets)
    }
}

/// A line a bucket, from the first that holds any to the last, and one with the mean and the longest.
impl fmt::Display for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let held = |(_, count): &(Option<Duration>, u64)| *count > 0;
        let skip = self.buckets().position(|bucket| held(&bucket)).unwrap_or(0);
        let rows: Vec<_> = self.buckets().skip(skip).collect();
        let last = rows.iter().rposition(held).map_or(0, |last| last + 1);
        let most = self.buckets.iter().max().copied().unwrap_or(0).max(1);
        for (end, count) in &rows[..last] {
            let end = end.map_or_else(|| "longer".into(), |end| format!("≤ {end:?}"));
            // Whatever was counted shows, however little it is beside the rest.
            let bar = (count * BAR).div_ceil(most);
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
    fn a_histogram_says_where_the_many_are_and_does_not_hide_the_one() {
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
    fn an_empty_histogram_has_nothing_to_say() {
        let empty = Histogram::default();
        assert_eq!((empty.at_most(0.5), empty.mean()), (None, Duration::ZERO));
        assert_eq!(empty.to_string().lines().count(), 1);
    }
}
