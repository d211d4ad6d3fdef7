//! Pairing of the footsteps of a leg in two runs.
//!
//! Given the lag D of the second run behind the first ([`Lag`]), common to all legs, the pairs of a
//! leg, in order of time in both runs, minimise
//!
//! ```text
//! Σ ½ (|δ_touch-down − D| + |δ_lift-off − D|)  +  ½ c S · (unpaired footsteps),    δ = b − a,
//! ```
//!
//! where S is the stride and c = 0.5. Each pair contributes its own distance; an extra footstep
//! therefore costs once, whereas a shift of all later footsteps by one stride costs a stride each.

use super::footstep::RecordedFootstep;
use super::lag::{Lag, Leg, distance, within};
use super::median::median;

/// c: maximum distance of a pair, in strides.
const PAIR_DISTANCE_MAX: f64 = 0.5;

/// Stride used if none is known: so long that any two footsteps can be paired \[s\].
const UNKNOWN_STRIDE: f64 = 1e9;

/// Time by which a footstep must end before the end of a recording to count as missing in it, in
/// strides.
const END_MARGIN: f64 = 0.25;

/// Pairs of footsteps of a leg in two runs, and the unpaired ones.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairing {
    /// Pairs, as indices into both runs, in order.
    pub pairs: Vec<(usize, usize)>,
    /// Footsteps of the first run without a counterpart in the second.
    pub only_in_a: Vec<usize>,
    /// Footsteps of the second run without a counterpart in the first.
    pub only_in_b: Vec<usize>,
    /// Number of footsteps of the first run beyond the end of the second.
    pub beyond_b: usize,
    /// Number of footsteps of the second run beyond the end of the first.
    pub beyond_a: usize,
}

/// Paired footsteps of all legs of two runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pairings {
    /// Stride of the legs \[s\]; `None` if no leg has two touch-downs.
    pub stride_s: Option<f64>,
    /// Pairing of each leg, in the order of the arguments.
    pub legs: Vec<Pairing>,
}

/// Pairs the footsteps of two runs that began together; `legs` contains for each leg the footsteps
/// of the first and of the second run, in order of time. `ends_s` are the end times of the runs
/// \[s\]; a footstep beyond the end of the other run does not count as missing.
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

/// Returns the common stride of the legs \[s\]: median time between successive touch-downs of a
/// leg, in the run in which it is longer, because extra footsteps shorten it.
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

/// Returns the pairs of a leg. The gain of a pair is its cost advantage over two unpaired
/// footsteps; the chain of pairs, increasing in both runs, with the largest total gain is found.
fn pairs([a, b]: Leg<'_>, lag: &Lag, stride: f64) -> Vec<(usize, usize)> {
    /// Best chain among those that end before a footstep of b.
    #[derive(Clone, Copy)]
    struct Best {
        gain: f64,
        link: Option<usize>,
    }
    let mut links: Vec<((usize, usize), Option<usize>)> = Vec::new();
    // Indexed by footstep of b, up to the last one in a chain; the last entry is valid for all
    // later ones.
    let mut best = vec![Best {
        gain: 0.0,
        link: None,
    }];
    for (i, step) in a.iter().enumerate() {
        let shift = lag.at(step.touch_down_s);
        let [expected, reach] = [step.touch_down_s + shift, 2.0 * PAIR_DISTANCE_MAX * stride];
        // In descending order, because a chain contains at most one pair of this footstep.
        for j in within(b, [expected - reach, expected + reach]).rev() {
            let gain = PAIR_DISTANCE_MAX * stride - distance(step, &b[j], shift);
            let before = best[j.min(best.len() - 1)];
            if gain <= 0.0 {
                continue;
            }
            let chain = Best {
                gain: before.gain + gain,
                link: Some(links.len()),
            };
            links.push(((i, j), before.link));
            if let Some(&last) = best.last() {
                best.resize(best.len().max(j + 2), last);
            }
            let worse = best[j + 1..].iter_mut();
            for entry in worse.take_while(|entry| entry.gain < chain.gain) {
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
    /// Pairs the footsteps of a leg at the given lag and classifies the rest.
    fn of(leg: Leg<'_>, lag: &Lag, stride_s: Option<f64>, ends_s: [f64; 2]) -> Self {
        let pairs = pairs(leg, lag, stride_s.unwrap_or(UNKNOWN_STRIDE));
        let slack = END_MARGIN * stride_s.unwrap_or(0.0);
        let [a, b] = leg;
        let unpaired = |steps: &[RecordedFootstep], paired: Vec<usize>| {
            let all = 0..steps.len();
            all.filter(move |n| paired.binary_search(n).is_err())
        };
        let (beyond_b, only_in_a): (Vec<usize>, Vec<usize>) =
            unpaired(a, pairs.iter().map(|pair| pair.0).collect())
                .partition(|&i| a[i].lift_off_s + lag.at(a[i].touch_down_s) > ends_s[1] - slack);
        let last_lag = lag.at(ends_s[0]);
        let (beyond_a, only_in_b): (Vec<usize>, Vec<usize>) =
            unpaired(b, pairs.iter().map(|pair| pair.1).collect())
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

    /// Cost of a set of pairs, evaluated directly from the sum in the module documentation.
    fn cost([a, b]: Leg<'_>, lag: &Lag, stride: f64, pairs: &Pairs) -> f64 {
        let gap = 0.5 * PAIR_DISTANCE_MAX * stride;
        let unpaired = (a.len() + b.len() - 2 * pairs.len()) as f64;
        let of_pair = |&(i, j): &(usize, usize)| {
            let lag = lag.at(a[i].touch_down_s);
            let touch_down = b[j].touch_down_s - a[i].touch_down_s - lag;
            let lift_off = b[j].lift_off_s - a[i].lift_off_s - lag;
            0.5 * (touch_down.abs() + lift_off.abs())
        };
        gap * unpaired + pairs.iter().map(of_pair).sum::<f64>()
    }

    type Pairs = [(usize, usize)];

    /// Minimum cost over all possible sets of pairs.
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
        fn pairs_have_minimum_cost(a in steps(6), b in steps(6), stride in 0.1..0.6_f64) {
            let leg: Leg<'_> = [&a, &b];
            let lag = Lag::between(&[leg], stride);
            let actual = cost(leg, &lag, stride, &pairs(leg, &lag, stride));
            let least = cheapest(leg, |pairs| cost(leg, &lag, stride, pairs));
            // Tolerance for sums of a dozen times in different order.
            prop_assert!((actual - least).abs() <= 1e-12 * least.max(1.0), "cost {actual}, minimum {least}");
        }

        #[test]
        fn footsteps_are_partitioned_into_paired_missing_and_beyond_the_end(
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

        /// A file may contain any number that JSON can represent.
        #[test]
        fn arbitrary_times_cause_no_panic(
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
    fn footsteps_beyond_the_end_of_the_other_run_are_not_missing() {
        let all: Vec<_> = (0..10).map(|i| step(0.3 * f64::from(i), 0.15)).collect();
        let pairing = &pair_footsteps(&[[&all, &all[..6]]], [3.0, 1.7]).legs[0];
        assert_eq!(pairing.pairs.len(), 6);
        assert_eq!((pairing.beyond_b, pairing.only_in_a.len()), (4, 0));
        // The second run lasts long enough for two of them.
        let pairing = &pair_footsteps(&[[&all, &all[..4]]], [3.0, 1.75]).legs[0];
        assert_eq!(pairing.only_in_a, [4, 5]);
    }
}
