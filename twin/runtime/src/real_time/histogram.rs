use std::fmt;
use std::time::Duration;

use hdrhistogram::Histogram as Bins;

/// Histogram of durations with a resolution of 1 %, so that rare long durations are visible beside
/// many short ones. Counting takes constant time and does not allocate.
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
/// assert_eq!(lateness.at_most(0.75).unwrap().as_micros(), 4);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    bins: Bins<u64>,
    sum_ns: u128,
    longest_ns: u64,
}

/// Duration from which all share the last bin: an hour \[ns\].
const LONGEST_BIN_NS: u64 = 3_600_000_000_000;

/// Significant decimal digits of a quantile.
const DIGITS: u8 = 2;

/// Upper end of the first row of the display \[ns\]; each further row ends at twice the one before.
const FIRST_ROW_NS: u64 = 1_000;

/// Length of the longest bar \[characters\].
const BAR: u64 = 40;

impl Default for Histogram {
    fn default() -> Self {
        Self {
            bins: Bins::new_with_bounds(1, LONGEST_BIN_NS, DIGITS).expect("constant bounds"),
            sum_ns: 0,
            longest_ns: 0,
        }
    }
}

impl Histogram {
    /// Counts a duration.
    pub fn count(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.bins.saturating_record(ns);
        self.sum_ns += u128::from(ns);
        self.longest_ns = self.longest_ns.max(ns);
    }

    /// Returns the number of durations counted.
    pub fn len(&self) -> u64 {
        self.bins.len()
    }

    /// Returns whether no duration was counted.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Returns the exact maximum; zero if empty.
    pub fn longest(&self) -> Duration {
        Duration::from_nanos(self.longest_ns)
    }

    /// Returns the exact mean; zero if empty.
    pub fn mean(&self) -> Duration {
        let mean = self.sum_ns / u128::from(self.len().max(1));
        Duration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX))
    }

    /// Returns the quantile of `share` (0 to 1), rounded up by less than 1 %; none if empty. Among
    /// durations above an hour it is the longest.
    pub fn at_most(&self, share: f64) -> Option<Duration> {
        let ns = self.bins.value_at_quantile(share);
        let ns = if ns < LONGEST_BIN_NS {
            ns.min(self.longest_ns)
        } else {
            self.longest_ns
        };
        (!self.is_empty()).then_some(Duration::from_nanos(ns))
    }
}

/// A line per doubling, from the first to the last that is not empty, and one with mean, quantiles
/// and maximum.
impl fmt::Display for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows: Vec<(u64, u64)> = self
            .bins
            .iter_log(FIRST_ROW_NS, 2.0)
            .map(|row| {
                (
                    row.value_iterated_to() + 1,
                    row.count_since_last_iteration(),
                )
            })
            .skip_while(|&(_, count)| count == 0)
            .collect();
        let peak = rows.iter().map(|&(_, count)| count).max().unwrap_or(1);
        for (end_ns, count) in rows {
            let end = format!("< {:?}", Duration::from_nanos(end_ns));
            // A row that is not empty has a bar of at least one character.
            let bar = usize::try_from((count * BAR).div_ceil(peak)).unwrap_or_default();
            writeln!(f, "{end:>12} {count:>9} {}", "#".repeat(bar))?;
        }
        write!(f, "        mean {:.1?}", self.mean())?;
        for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
            if let Some(quantile) = self.at_most(share) {
                write!(f, ", {name} {quantile:.1?}")?;
            }
        }
        write!(f, ", longest {:.1?}, of {}", self.longest(), self.len())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn rare_long_durations_are_visible_beside_many_short_ones() {
        let mut histogram = Histogram::default();
        for _ in 0..900 {
            histogram.count(Duration::from_micros(3));
        }
        for _ in 0..100 {
            histogram.count(Duration::from_micros(40));
        }
        histogram.count(Duration::from_secs(3));
        let text = histogram.to_string();
        let lines: Vec<&str> = text.lines().collect();
        let row =
            |end: &str, count: u64, bar: usize| format!("{end:>12} {count:>9} {}", "#".repeat(bar));
        assert_eq!(lines[0], row("< 4µs", 900, 40));
        assert_eq!(lines[4], row("< 64µs", 100, 5));
        assert_eq!(lines[lines.len() - 2], row("< 4.194304s", 1, 1));
        assert!(
            lines[lines.len() - 1].ends_with("p99 40.2µs, longest 3.0s, of 1001"),
            "{text}"
        );
    }

    proptest! {
        #[test]
        fn quantiles_are_above_the_exact_ones_by_less_than_a_percent(
            mut values in proptest::collection::vec(0_u64..100_000_000, 1..200),
            index: proptest::sample::Index,
        ) {
            let mut histogram = Histogram::default();
            for &ns in &values {
                histogram.count(Duration::from_nanos(ns));
            }
            values.sort_unstable();
            let rank = index.index(values.len());
            let share = (rank as f64 + 0.5) / values.len() as f64;
            let exact = values[rank] as f64;
            let quantile = histogram.at_most(share).unwrap().as_nanos() as f64;
            prop_assert!((exact..=exact * 1.01).contains(&quantile), "{} {}", exact, quantile);
            prop_assert_eq!(histogram.at_most(1.0), Some(histogram.longest()));
        }
    }

    #[test]
    fn durations_beyond_the_bins_are_counted() {
        let mut histogram = Histogram::default();
        histogram.count(Duration::MAX);
        assert_eq!(histogram.len(), 1);
        assert_eq!(histogram.at_most(0.5), Some(Duration::from_nanos(u64::MAX)));
        assert_eq!(
            histogram
                .to_string()
                .lines()
                .last()
                .map(|line| line.ends_with("of 1")),
            Some(true)
        );
    }

    #[test]
    fn counting_does_not_allocate() {
        let mut histogram = Histogram::default();
        let allocated = allocation_counter::measure(|| {
            for power in 0..64 {
                histogram.count(Duration::from_nanos(1 << power));
            }
        });
        assert_eq!(allocated.count_total, 0);
        assert_eq!(histogram.len(), 64);
    }

    #[test]
    fn empty_histogram_has_no_rows() {
        let empty = Histogram::default();
        assert_eq!((empty.at_most(0.5), empty.mean()), (None, Duration::ZERO));
        assert_eq!(empty.to_string().lines().count(), 1);
    }
}
