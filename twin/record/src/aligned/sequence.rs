//! Which footstep of one leg is which in another run.
//!
//! Two runs that part do so by degrees: a footstep comes a little later than it did, the next one later still. So what tells
//! that two footsteps are the same is not when they happen, but that they are as much apart as those before them were. With
//! the offsets δ = b − a of touch-down and lift-off, the pairs are those that make
//!
//! ```text
//! Σ ½ (|Δδ_touch-down| + |Δδ_lift-off|) + g · (footsteps without a partner)       δ is 0 before the first pair
//! ```
//!
//! least, where Δ is from one pair to the next. g is a share of a stride: a footstep without a partner costs less than to be
//! a stride late from there on, and more than to come early or late once.

use super::footstep::RecordedFootstep;
use super::median::median;

/// What a footstep without a partner costs, in strides.
const GAP: f64 = 0.6;

/// A stride where none is known: so long that any two footsteps are a pair \[s\].
const AGES: f64 = 1e9;

/// Footsteps without a partner between two pairs, at most.
const MISSING_MAX: usize = 16;

/// How many footsteps two runs may come to differ by.
const BAND: usize = 64;

/// How much earlier than a recording ends a footstep has to end to be missed in it, in strides.
const NEAR_THE_END: f64 = 0.25;

/// The pairs, and what has none.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Alignment {
    /// Indices into both.
    pub(super) pairs: Vec<(usize, usize)>,
    pub(super) only_in_a: Vec<usize>,
    pub(super) only_in_b: Vec<usize>,
    /// Those that the other had no time for: it ends too early.
    pub(super) beyond_b: usize,
    pub(super) beyond_a: usize,
}

/// Aligns footsteps that are in order of time; `ends` is when either run ended \[s\].
pub(super) fn align(a: &[RecordedFootstep], b: &[RecordedFootstep], ends: [f64; 2]) -> Alignment {
    let stride = stride(a, b);
    let gap = GAP * stride.unwrap_or(AGES);
    let table = Table::filled(a, b, gap);
    let slack = NEAR_THE_END * stride.unwrap_or(0.0);
    let beyond = |last: Option<(usize, usize)>| {
        let (offset, [i, j]) = last.map_or((0.0, [0, 0]), |(i, j)| {
            (b[j].lift_off_s - a[i].lift_off_s, [i + 1, j + 1])
        });
        let (rest_a, rest_b) = (&a[i..], &b[j..]);
        let late = |steps: &[RecordedFootstep], offset: f64, end: f64| {
            let late = steps.iter();
            late.filter(|step| step.lift_off_s + offset > end - slack)
                .count()
        };
        // Where both have some left, they could be pairs.
        [
            late(rest_a, offset, ends[1]).min(rest_a.len().saturating_sub(rest_b.len())),
            late(rest_b, -offset, ends[0]).min(rest_b.len().saturating_sub(rest_a.len())),
        ]
    };
    // What is left behind the last pair costs as much as anywhere, but what the other had no time for.
    let cost_of_end = |last: Option<(usize, usize)>| {
        let (i, j) = last.map_or((0, 0), |(i, j)| (i + 1, j + 1));
        let [free_a, free_b] = beyond(last);
        let rest = (a.len() - i - free_a) + (b.len() - j - free_b);
        gap * rest as f64
    };
    let mut best = (cost_of_end(None), None);
    for i in 0..a.len() {
        for j in table.columns(i) {
            let cost = table.at(i, j).cost + cost_of_end(Some((i, j)));
            if cost < best.0 {
                best = (cost, Some((i, j)));
            }
        }
    }
    let mut alignment = Alignment::default();
    let mut last = best.1;
    while let Some((i, j)) = last {
        alignment.pairs.push((i, j));
        last = table.at(i, j).before;
    }
    alignment.pairs.reverse();
    let [free_a, free_b] = beyond(best.1);
    let without = |count: usize, paired: &dyn Fn(&(usize, usize)) -> usize| {
        let paired: Vec<usize> = alignment.pairs.iter().map(paired).collect();
        (0..count).filter(move |i| paired.binary_search(i).is_err())
    };
    // Lift-offs need not be in order of touch-downs where a recording is odd; then the last ones count.
    alignment.only_in_a = without(a.len() - free_a, &|pair| pair.0).collect();
    alignment.only_in_b = without(b.len() - free_b, &|pair| pair.1).collect();
    (alignment.beyond_b, alignment.beyond_a) = (free_a, free_b);
    alignment
}

/// The time from one touch-down to the next, the median of both runs \[s\]; none where there are not two in either.
fn stride(a: &[RecordedFootstep], b: &[RecordedFootstep]) -> Option<f64> {
    let between = |steps: &[RecordedFootstep]| {
        let pairs = steps.windows(2);
        let times = pairs.map(|pair| pair[1].touch_down_s - pair[0].touch_down_s);
        times.collect::<Vec<_>>()
    };
    let mut all = between(a);
    all.extend(between(b));
    median(&all).filter(|stride| *stride > 0.0)
}

/// The least cost of every way that ends in a pair, and the pair before it.
#[derive(Debug, Clone, Copy)]
struct Way {
    cost: f64,
    before: Option<(usize, usize)>,
}

/// Ways by pair, as far as a pair may be off the diagonal.
struct Table {
    ways: Vec<Way>,
    width: usize,
    band: usize,
    columns: usize,
}

impl Table {
    fn filled(a: &[RecordedFootstep], b: &[RecordedFootstep], gap: f64) -> Self {
        let band = BAND + a.len().abs_diff(b.len());
        let mut table = Self {
            ways: Vec::with_capacity(a.len() * (2 * band + 1)),
            width: 2 * band + 1,
            band,
            columns: b.len(),
        };
        let offsets = |i: usize, j: usize| {
            let (a, b) = (&a[i], &b[j]);
            [b.touch_down_s - a.touch_down_s, b.lift_off_s - a.lift_off_s]
        };
        let change = |from: [f64; 2], to: [f64; 2]| {
            0.5 * ((to[0] - from[0]).abs() + (to[1] - from[1]).abs())
        };
        for i in 0..a.len() {
            for place in 0..table.width {
                let j = (i + place).wrapping_sub(band);
                let mut way = Way {
                    cost: f64::INFINITY,
                    before: None,
                };
                if j < b.len() {
                    let here = offsets(i, j);
                    way.cost = gap * (i + j) as f64 + change([0.0; 2], here);
                    for (skipped, (k, l)) in table.before(i, j) {
                        let cost = table.at(k, l).cost
                            + gap * skipped as f64
                            + change(offsets(k, l), here);
                        // At even cost the one with fewer gaps, which comes first among these.
                        if cost < way.cost || (way.before.is_none() && cost <= way.cost) {
                            way = Way {
                                cost,
                                before: Some((k, l)),
                            };
                        }
                    }
                }
                table.ways.push(way);
            }
        }
        table
    }

    /// The pairs that may come before a pair, those with fewer footsteps between first.
    fn before(&self, i: usize, j: usize) -> impl Iterator<Item = (usize, (usize, usize))> + use<> {
        let band = self.band;
        (0..=MISSING_MAX).flat_map(move |skipped| {
            (0..=skipped).filter_map(move |of_a| {
                let k = i.checked_sub(1 + of_a)?;
                let l = j.checked_sub(1 + skipped - of_a)?;
                (l + band >= k && l <= k + band).then_some((skipped, (k, l)))
            })
        })
    }

    fn columns(&self, i: usize) -> core::ops::Range<usize> {
        i.saturating_sub(self.band)..(i + self.band + 1).min(self.columns)
    }

    fn at(&self, i: usize, j: usize) -> &Way {
        &self.ways[i * self.width + j + self.band - i]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn step(touch_down_s: f64, lasts_s: f64) -> RecordedFootstep {
        RecordedFootstep {
            touch_down_s,
            lift_off_s: touch_down_s + lasts_s,
            position_m: None,
        }
    }

    /// What a choice of pairs costs, straight from the sum in the documentation; nothing is beyond any end.
    fn cost(a: &[RecordedFootstep], b: &[RecordedFootstep], pairs: &[(usize, usize)]) -> f64 {
        let gap = GAP * stride(a, b).unwrap_or(AGES);
        let mut before = [0.0; 2];
        let mut sum = gap * (a.len() + b.len() - 2 * pairs.len()) as f64;
        for &(i, j) in pairs {
            let now = [
                b[j].touch_down_s - a[i].touch_down_s,
                b[j].lift_off_s - a[i].lift_off_s,
            ];
            sum += 0.5 * ((now[0] - before[0]).abs() + (now[1] - before[1]).abs());
            before = now;
        }
        sum
    }

    type Pairs = [(usize, usize)];

    /// Every choice of pairs there is, and the cost of the cheapest.
    fn cheapest(a: &[RecordedFootstep], b: &[RecordedFootstep]) -> f64 {
        fn all(
            [i, j]: [usize; 2],
            [n, m]: [usize; 2],
            pairs: &mut Vec<(usize, usize)>,
            found: &mut dyn FnMut(&Pairs),
        ) {
            found(pairs);
            for k in i..n {
                for l in j..m {
                    pairs.push((k, l));
                    all([k + 1, l + 1], [n, m], pairs, found);
                    pairs.pop();
                }
            }
        }
        let mut least = f64::INFINITY;
        all([0; 2], [a.len(), b.len()], &mut Vec::new(), &mut |pairs| {
            least = least.min(cost(a, b, pairs));
        });
        least
    }

    fn steps(most: usize) -> impl Strategy<Value = Vec<RecordedFootstep>> {
        prop::collection::vec((0.05..0.6_f64, 0.02..0.5_f64), 0..=most).prop_map(|steps| {
            let mut at = 0.0;
            let step = |(pause, lasts): (f64, f64)| {
                at += pause;
                step(at, lasts)
            };
            steps.into_iter().map(step).collect()
        })
    }

    proptest! {
        #[test]
        fn no_other_pairs_would_cost_less(a in steps(6), b in steps(6)) {
            let alignment = align(&a, &b, [1e6; 2]);
            let mine = cost(&a, &b, &alignment.pairs);
            let least = cheapest(&a, &b);
            // Sums of a dozen times, taken in another order; those of a stride of ages are larger.
            let rounding = 1e-12 * least.max(1.0);
            prop_assert!((mine - least).abs() <= rounding, "{mine} where {least} will do: {alignment:?}");
            prop_assert_eq!(alignment.beyond_a + alignment.beyond_b, 0);
        }

        #[test]
        fn every_footstep_is_in_a_pair_or_named_as_without_or_beyond(
            a in steps(40), b in steps(40), ends in [0.0..20.0_f64, 0.0..20.0_f64],
        ) {
            let alignment = align(&a, &b, ends);
            let pairs = &alignment.pairs;
            prop_assert!(pairs.windows(2).all(|two| two[0].0 < two[1].0 && two[0].1 < two[1].1));
            prop_assert_eq!(pairs.len() + alignment.only_in_a.len() + alignment.beyond_b, a.len());
            prop_assert_eq!(pairs.len() + alignment.only_in_b.len() + alignment.beyond_a, b.len());
            prop_assert!(alignment.only_in_a.iter().all(|i| pairs.iter().all(|pair| pair.0 != *i)));
            prop_assert!(alignment.only_in_b.iter().all(|j| pairs.iter().all(|pair| pair.1 != *j)));
        }
    }

    #[test]
    fn what_the_other_had_no_time_for_is_not_missed() {
        let all: Vec<_> = (0..10).map(|i| step(0.3 * f64::from(i), 0.15)).collect();
        let alignment = align(&all, &all[..6], [3.0, 1.7]);
        assert_eq!(alignment.pairs.len(), 6);
        assert_eq!((alignment.beyond_b, alignment.only_in_a.len()), (4, 0));
        // It had time enough for two of them.
        let alignment = align(&all, &all[..4], [3.0, 1.75]);
        assert_eq!(alignment.only_in_a, [4, 5]);
    }
}
