//! Which footstep of a leg is which in another run.
//!
//! Given the lag D of the second run behind the first ([`Lag`]), which all legs have in common, the pairs of a leg are those
//! that make
//!
//! ```text
//! Σ ½ (|δ_touch-down − D| + |δ_lift-off − D|)  +  ½ c S · (footsteps without a partner)       δ = b − a
//! ```
//!
//! least, in order of time in both runs, where S is the stride and c = 0.5. Every pair pays for its own distance, so an
//! extra footstep costs once, and a shift of all footsteps behind it by one stride costs a stride each.

use super::footstep::RecordedFootstep;
use super::lag::{Lag, Leg, distance, within};
use super::median::median;

/// c: the distance at which two footsteps are no pair, in strides.
const APART: f64 = 0.5;

/// A stride where none is known: so long that any two footsteps are a pair \[s\].
const AGES: f64 = 1e9;

/// How much earlier than a recording ends a footstep has to end to be missed in it, in strides.
const NEAR_THE_END: f64 = 0.25;

/// Which footsteps of a leg in two runs are the same, and which have no partner.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairing {
    /// Those that are the same, as indices into both, in order.
    pub pairs: Vec<(usize, usize)>,
    /// Those of the first run that the second does not have.
    pub only_in_a: Vec<usize>,
    /// Those of the second run that the first does not have.
    pub only_in_b: Vec<usize>,
    /// How many at the end of the first run the second had no time for.
    pub beyond_b: usize,
    /// How many at the end of the second run the first had no time for.
    pub beyond_a: usize,
}

/// The footsteps of all legs of two runs, paired.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pairings {
    /// The stride of the legs \[s\]; none where no leg comes down twice.
    pub stride_s: Option<f64>,
    /// Of each leg, in the order in which they were given.
    pub legs: Vec<Pairing>,
}

/// Pairs the footsteps of two runs that began together: of each leg those of the first run and those of the second, in order
/// of time. `ends_s` is when either run ended: no footstep is missed behind it \[s\].
pub fn pair_footsteps(legs: &[[&[RecordedFootstep]; 2]], ends_s: [f64; 2]) -> Pairings {
    let stride_s = stride(legs);
    let lag = stride_s.map_or_else(Lag::default, |stride| {
        let lag = Lag::between(legs, stride);
        let paired: Vec<_> = legs.iter().map(|leg| pairs(*leg, &lag, stride)).collect();
        let paired = legs.iter().zip(&paired).flat_map(|([a, b], pairs)| {
            let footsteps = |&(i, j): &(usize, usize)| [a[i], b[j]];
            pairs.iter().map(footsteps)
        });
        lag.refined(paired, stride)
    });
    let pairing = |leg: &Leg<'_>| Pairing::of(*leg, &lag, stride_s, ends_s);
    Pairings {
        stride_s,
        legs: legs.iter().map(pairing).collect(),
    }
}

/// The stride that the legs have in common: the median time from one touch-down of a leg to its next, in the run in which it
/// is longer, since many extra footsteps make it shorter \[s\].
fn stride(legs: &[Leg<'_>]) -> Option<f64> {
    let of_run = |run: usize| {
        let pairs = legs.iter().flat_map(|leg| leg[run].windows(2));
        let times = pairs.map(|pair| pair[1].touch_down_s - pair[0].touch_down_s);
        median(&times.collect::<Vec<_>>()).filter(|stride| *stride > 0.0)
    };
    [of_run(0), of_run(1)]
        .into_iter()
        .flatten()
        .reduce(f64::max)
}

/// The pairs of a leg. A pair is worth what it costs less than two footsteps without a partner; the most valuable chain of
/// pairs that rises in both runs is found.
fn pairs([a, b]: Leg<'_>, lag: &Lag, stride: f64) -> Vec<(usize, usize)> {
    /// The best chain of those that end before a footstep of b.
    #[derive(Clone, Copy)]
    struct Best {
        worth: f64,
        link: Option<usize>,
    }
    let mut links: Vec<((usize, usize), Option<usize>)> = Vec::new();
    // By footstep of b, as far as one is in a chain; behind that the last entry holds.
    let mut best = vec![Best {
        worth: 0.0,
        link: None,
    }];
    for (i, step) in a.iter().enumerate() {
        let shift = lag.at(step.touch_down_s);
        let [expected, reach] = [step.touch_down_s + shift, 2.0 * APART * stride];
        // From the last to the first, since a chain has one pair of this footstep only.
        for j in within(b, [expected - reach, expected + reach]).rev() {
            let worth = APART * stride - distance(step, &b[j], shift);
            let before = best[j.min(best.len() - 1)];
            if worth <= 0.0 {
                continue;
            }
            let chain = Best {
                worth: before.worth + worth,
                link: Some(links.len()),
            };
            links.push(((i, j), before.link));
            if let Some(&last) = best.last() {
                best.resize(best.len().max(j + 2), last);
            }
            let worse = best[j + 1..].iter_mut();
            for entry in worse.take_while(|entry| entry.worth < chain.worth) {
                *entry = chain;
            }
        }
    }
    let mut pairs = Vec::new();
    let mut link = best.last().and_then(|best| best.link);
    while let Some((pair, before)) = link.and_then(|link| links.get(link)) {
        pairs.push(*pair);
        link = *before;
    }
    pairs.reverse();
    pairs
}

impl Pairing {
    /// The pairs of a leg at a lag, and the rest.
    fn of(leg: Leg<'_>, lag: &Lag, stride_s: Option<f64>, ends_s: [f64; 2]) -> Self {
        let pairs = pairs(leg, lag, stride_s.unwrap_or(AGES));
        let slack = NEAR_THE_END * stride_s.unwrap_or(0.0);
        let [a, b] = leg;
        let lonely = |steps: &[RecordedFootstep], paired: Vec<usize>| {
            let all = 0..steps.len();
            all.filter(move |n| paired.binary_search(n).is_err())
        };
        let (beyond_b, only_in_a): (Vec<usize>, Vec<usize>) =
            lonely(a, pairs.iter().map(|pair| pair.0).collect())
                .partition(|&i| a[i].lift_off_s + lag.at(a[i].touch_down_s) > ends_s[1] - slack);
        let last_lag = lag.at(ends_s[0]);
        let (beyond_a, only_in_b): (Vec<usize>, Vec<usize>) =
            lonely(b, pairs.iter().map(|pair| pair.1).collect())
                .partition(|&j| b[j].lift_off_s - last_lag > ends_s[0] - slack);
        Self {
            pairs,
            only_in_a,
            only_in_b,
            beyond_b: beyond_b.len(),
            beyond_a: beyond_a.len(),
        }
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

    /// What a choice of pairs costs, straight from the sum in the documentation.
    fn cost([a, b]: Leg<'_>, lag: &Lag, stride: f64, pairs: &Pairs) -> f64 {
        let gap = 0.5 * APART * stride;
        let lonely = (a.len() + b.len() - 2 * pairs.len()) as f64;
        let of_pair = |&(i, j): &(usize, usize)| {
            let lag = lag.at(a[i].touch_down_s);
            let touch_down = b[j].touch_down_s - a[i].touch_down_s - lag;
            let lift_off = b[j].lift_off_s - a[i].lift_off_s - lag;
            0.5 * (touch_down.abs() + lift_off.abs())
        };
        gap * lonely + pairs.iter().map(of_pair).sum::<f64>()
    }

    type Pairs = [(usize, usize)];

    /// Every choice of pairs there is, and the cost of the cheapest.
    fn cheapest([a, b]: Leg<'_>, cost: impl Fn(&Pairs) -> f64) -> f64 {
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
            least = least.min(cost(pairs));
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
        fn no_other_pairs_would_cost_less(a in steps(6), b in steps(6), stride in 0.1..0.6_f64) {
            let leg: Leg<'_> = [&a, &b];
            let lag = Lag::between(&[leg], stride);
            let mine = cost(leg, &lag, stride, &pairs(leg, &lag, stride));
            let least = cheapest(leg, |pairs| cost(leg, &lag, stride, pairs));
            // Sums of a dozen times, taken in another order.
            prop_assert!((mine - least).abs() <= 1e-12 * least.max(1.0), "{mine} where {least} will do");
        }

        #[test]
        fn every_footstep_is_in_a_pair_or_named_as_without_or_beyond(
            a in steps(40), b in steps(40), ends in [0.0..20.0_f64, 0.0..20.0_f64],
        ) {
            let pairing = &pair_footsteps(&[[&a, &b]], ends).legs[0];
            let pairs = &pairing.pairs;
            prop_assert!(pairs.windows(2).all(|two| two[0].0 < two[1].0 && two[0].1 < two[1].1));
            prop_assert_eq!(pairs.len() + pairing.only_in_a.len() + pairing.beyond_b, a.len());
            prop_assert_eq!(pairs.len() + pairing.only_in_b.len() + pairing.beyond_a, b.len());
            prop_assert!(pairing.only_in_a.iter().all(|i| pairs.iter().all(|pair| pair.0 != *i)));
            prop_assert!(pairing.only_in_b.iter().all(|j| pairs.iter().all(|pair| pair.1 != *j)));
        }

        /// A file may hold any number that JSON can write.
        #[test]
        fn absurd_times_are_no_panic(
            a in prop::collection::vec((any::<f64>(), any::<f64>()), 0..8),
            b in prop::collection::vec((any::<f64>(), any::<f64>()), 0..8),
        ) {
            let [a, b] = [a, b].map(|times| {
                let mut steps: Vec<_> = times.iter().map(|&(at, lasts)| step(at, lasts)).collect();
                steps.sort_by(|a, b| a.touch_down_s.total_cmp(&b.touch_down_s));
                steps
            });
            let pairing = &pair_footsteps(&[[&a, &b]], [1.0; 2]).legs[0];
            prop_assert!(pairing.pairs.len() <= a.len().min(b.len()));
        }
    }

    #[test]
    fn footsteps_that_the_other_had_no_time_for_are_not_missed() {
        let all: Vec<_> = (0..10).map(|i| step(0.3 * f64::from(i), 0.15)).collect();
        let pairing = &pair_footsteps(&[[&all, &all[..6]]], [3.0, 1.7]).legs[0];
        assert_eq!(pairing.pairs.len(), 6);
        assert_eq!((pairing.beyond_b, pairing.only_in_a.len()), (4, 0));
        // It had time enough for two of them.
        let pairing = &pair_footsteps(&[[&all, &all[..4]]], [3.0, 1.75]).legs[0];
        assert_eq!(pairing.only_in_a, [4, 5]);
    }
}
