use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Resolved bits of an interval: the width of a class is 1/128 of its value.
const RESOLVED_BITS: u32 = 7;
/// Width of the classes of the shortest intervals: 8 ns, which is 1/128 of 1.024 µs.
const UNIT_BITS: u32 = 3;
/// Intervals of 2³⁴ ns (17 s) and longer share the last class.
const LONGEST_BITS: u32 = 34;
/// Number of classes: 128 linear ones, then 128 per octave.
const CLASSES: usize = ((LONGEST_BITS - UNIT_BITS - RESOLVED_BITS + 1) << RESOLVED_BITS) as usize;
const WORDS: usize = CLASSES.div_ceil(64);

/// Percentiles that are maintained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Percentile {
    P50,
    P99,
    P999,
}

impl Percentile {
    pub(crate) const ALL: [Self; 3] = [Self::P50, Self::P99, Self::P999];

    /// Returns the rank among `count` intervals in order of length, from 1, by the nearest-rank
    /// definition.
    pub(crate) fn rank(self, count: u64) -> u64 {
        let (share, of) = match self {
            Self::P50 => (1, 2),
            Self::P99 => (99, 100),
            Self::P999 => (999, 1_000),
        };
        (count * share).div_ceil(of)
    }
}

/// Log-linear histogram of intervals with incrementally maintained percentiles p50, p99 and p999.
///
/// A percentile is defined by the nearest rank: of n intervals in order of length the one with
/// number ⌈p·n⌉. It is reported as the mean of the class that contains this interval; its error is
/// less than the width of the class: 1/128 of the value, or 8 ns where that is more, up to 17 s. It
/// is exact where all intervals of the class are equal.
///
/// Memory is bounded (51 kB), and adding an interval takes a bounded time: every percentile keeps
/// its class and the number of shorter intervals, and moves from one occupied class to the next.
#[derive(Clone, Debug)]
pub(crate) struct IntervalHistogram {
    classes: Vec<Class>,
    /// Bit set of the classes that contain an interval.
    occupied: [u64; WORDS],
    count: u64,
    /// Positions of [`Percentile::ALL`].
    cursors: [Cursor; 3],
}

#[derive(Clone, Copy, Debug, Default)]
struct Class {
    count: u64,
    sum_ns: u64,
}

/// Position of a percentile.
#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    class: usize,
    /// Number of intervals in lower classes.
    below: u64,
}

impl Default for IntervalHistogram {
    fn default() -> Self {
        Self {
            classes: vec![Class::default(); CLASSES],
            occupied: [0; WORDS],
            count: 0,
            cursors: [Cursor::default(); 3],
        }
    }
}

/// Returns the class of an interval.
fn class_of(interval_ns: u64) -> usize {
    let units = (interval_ns >> UNIT_BITS).min((1 << (LONGEST_BITS - UNIT_BITS)) - 1);
    let doublings = units
        .checked_ilog2()
        .map_or(0, |bits| bits.saturating_sub(RESOLVED_BITS));
    #[expect(clippy::cast_possible_truncation, reason = "below CLASSES")]
    let class = (u64::from(doublings << RESOLVED_BITS) + (units >> doublings)) as usize;
    class
}

impl IntervalHistogram {
    /// Returns the number of intervals.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn add(&mut self, interval_ns: u64) {
        self.add_to(class_of(interval_ns), 1, interval_ns);
    }

    fn add_to(&mut self, class: usize, count: u64, sum_ns: u64) {
        let first = self.count == 0;
        self.count += count;
        let entry = &mut self.classes[class];
        entry.count += count;
        entry.sum_ns = entry.sum_ns.saturating_add(sum_ns);
        self.occupied[class / 64] |= 1 << (class % 64);
        for (index, percentile) in Percentile::ALL.into_iter().enumerate() {
            let mut cursor = self.cursors[index];
            if first {
                cursor.class = class;
            } else if class < cursor.class {
                cursor.below += count;
            }
            self.cursors[index] = self.move_to_rank(cursor, percentile.rank(self.count));
        }
    }

    /// Moves a percentile to the class of its rank.
    fn move_to_rank(&self, mut cursor: Cursor, rank: u64) -> Cursor {
        loop {
            let here = self.classes[cursor.class].count;
            let moved = if cursor.below >= rank {
                self.previous(cursor.class)
            } else if cursor.below + here < rank {
                self.next(cursor.class)
            } else {
                None
            };
            let Some(class) = moved else {
                return cursor;
            };
            if class < cursor.class {
                cursor.below -= self.classes[class].count;
            } else {
                cursor.below += here;
            }
            cursor.class = class;
        }
    }

    /// Returns the next occupied class above.
    fn next(&self, class: usize) -> Option<usize> {
        let start = class + 1;
        let masked = |word: usize| {
            if word == start / 64 {
                self.occupied[word] & (u64::MAX << (start % 64))
            } else {
                self.occupied[word]
            }
        };
        let word = (start / 64..WORDS).find(|word| masked(*word) != 0)?;
        Some(64 * word + masked(word).trailing_zeros() as usize)
    }

    /// Returns the next occupied class below.
    fn previous(&self, class: usize) -> Option<usize> {
        let masked = |word: usize| {
            if word == class / 64 {
                self.occupied[word] & !(u64::MAX << (class % 64))
            } else {
                self.occupied[word]
            }
        };
        let word = (0..=class / 64).rev().find(|word| masked(*word) != 0)?;
        Some(64 * word + 63 - masked(word).leading_zeros() as usize)
    }

    /// Returns the percentile \[ns\]; 0 before the first interval.
    pub(crate) fn percentile(&self, percentile: Percentile) -> f64 {
        let class = self.classes[self.cursors[percentile as usize].class];
        class.sum_ns as f64 / (class.count.max(1) as f64)
    }

    /// Returns index, count and sum of the occupied classes in ascending order.
    fn occupied(&self) -> impl Iterator<Item = (usize, u64, u64)> {
        let classes = self.classes.iter().enumerate();
        let occupied = classes.filter(|(_, class)| class.count > 0);
        occupied.map(|(at, class)| (at, class.count, class.sum_ns))
    }
}

/// Serialises the occupied classes only: the cursors follow from them.
impl Serialize for IntervalHistogram {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let occupied: Vec<(usize, u64, u64)> = self.occupied().collect();
        occupied.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for IntervalHistogram {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let occupied = Vec::<(usize, u64, u64)>::deserialize(deserializer)?;
        let mut histogram = Self::default();
        for (class, count, sum_ns) in occupied {
            if class >= CLASSES || count == 0 {
                let message = format!("class {class} with {count} intervals in a histogram");
                return Err(de::Error::custom(message));
            }
            histogram.add_to(class, count, sum_ns);
        }
        Ok(histogram)
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;
    use twinrig_kernel::Snapshot;

    use super::*;

    fn histogram(intervals: &[u64]) -> IntervalHistogram {
        let mut histogram = IntervalHistogram::default();
        for interval in intervals {
            histogram.add(*interval);
        }
        histogram
    }

    fn percentiles(histogram: &IntervalHistogram) -> [f64; 3] {
        Percentile::ALL.map(|percentile| histogram.percentile(percentile))
    }

    /// Intervals spread over all magnitudes, concentrated around one value, or of few distinct
    /// values.
    fn intervals() -> impl Strategy<Value = Vec<u64>> {
        let any_magnitude =
            (0..34_u32, any::<u64>()).prop_map(|(bits, random)| random >> (63 - bits));
        prop_oneof![
            vec(any_magnitude, 1..600),
            vec(2_000_000..2_100_000_u64, 1..3_000),
            vec(
                prop_oneof![50 => Just(2_500_000_u64), 1 => Just(3_875_000), 1 => Just(0)],
                1..3_000
            ),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn percentile_equals_nearest_rank_within_the_class_width(intervals in intervals()) {
            let histogram = histogram(&intervals);
            let mut sorted = intervals.clone();
            sorted.sort_unstable();
            for percentile in Percentile::ALL {
                // Definition: the shortest interval than which at least this fraction of all is not
                // longer.
                let rank = usize::try_from(percentile.rank(sorted.len() as u64)).unwrap();
                let (exact, found) = (sorted[rank - 1] as f64, histogram.percentile(percentile));
                let width = (exact / 128.0).max(8.0);
                prop_assert!((found - exact).abs() < width, "{percentile:?}: {found}, not {exact}");
                let (shortest, longest) = (sorted[0] as f64, sorted[sorted.len() - 1] as f64);
                prop_assert!(found >= shortest && found <= longest);
            }
        }

        #[test]
        fn percentiles_are_independent_of_order_and_of_snapshots(
            intervals in intervals(), cut in any::<prop::sample::Index>(),
        ) {
            let straight = histogram(&intervals);
            let mut sorted = intervals.clone();
            sorted.sort_unstable();
            prop_assert_eq!(percentiles(&histogram(&sorted)), percentiles(&straight));
            let (before, after) = intervals.split_at(cut.index(intervals.len()));
            let mut resumed: IntervalHistogram = Snapshot::of(&histogram(before)).read().unwrap();
            for interval in after {
                resumed.add(*interval);
            }
            prop_assert_eq!(percentiles(&resumed), percentiles(&straight));
            prop_assert_eq!(Snapshot::of(&resumed), Snapshot::of(&straight));
        }
    }

    #[test]
    fn classes_are_monotonic_with_documented_widths() {
        let mut last = 0;
        for bits in 0..63 {
            for interval in [
                1_u64 << bits,
                (1 << bits) + 1,
                (1 << bits) | (1 << bits >> 1),
            ] {
                let class = class_of(interval);
                assert!(class >= last && class < CLASSES, "{interval}: {class}");
                last = class;
            }
        }
        for (longest, width) in [
            (1_023, 8),
            (2_047, 8),
            (2_500_000, 16_384),
            (17_179_869_183, 1 << 26),
        ] {
            let class = class_of(longest / width * width);
            assert_eq!(class_of(longest / width * width + width - 1), class);
            assert_eq!(
                class_of(longest / width * width + width),
                (class + 1).min(CLASSES - 1)
            );
        }
        assert_eq!(class_of(u64::MAX), CLASSES - 1);
    }

    #[test]
    fn snapshot_with_invalid_class_is_rejected() {
        for bad in [(CLASSES, 1_u64, 1_u64), (3, 0, 0)] {
            assert!(
                Snapshot::of(&vec![bad])
                    .read::<IntervalHistogram>()
                    .is_err()
            );
        }
    }
}
