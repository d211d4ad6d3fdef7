//! Time budget of a study, and its allocation to parts.

use crate::stopwatch::{Deadline, Stopwatch};

/// Greatest multiple of the even share of the remaining time that a part may use; most use less.
const EVEN_SHARES_MAX: f64 = 4.0;
/// Share of the even part of the total that is reserved for each part to come, so that slow or
/// early parts do not starve later ones.
const RESERVED_SHARE: f64 = 0.5;
/// Least time of a part \[s\]: sufficient for fast runs, and short enough for hundreds of parts
/// after the budget is spent.
const LEAST_S: f64 = 0.02;

/// Share of a part in the budget, relative to those of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weight {
    /// Run of a row.
    Run,
    /// Reference run, or a run many times as long as that of a row.
    Reference,
    /// A hundred complete walks.
    Ensemble,
}

impl Weight {
    fn value(self) -> usize {
        match self {
            Self::Run => 1,
            Self::Reference => 8,
            Self::Ensemble => 40,
        }
    }
}

/// Time budget of a study, shared among its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    total_s: f64,
    stopwatch: Stopwatch,
    /// Time of earlier starts of the program \[s\].
    charged_s: f64,
    parts: usize,
    begun: usize,
    /// Total weight of the parts.
    weight: usize,
    weight_begun: usize,
}

/// Time allotted to a part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share {
    /// \[s\]
    pub(crate) seconds: f64,
    pub(crate) deadline: Deadline,
}

impl Share {
    /// Returns this share of it, from now on.
    pub(crate) fn fraction(self, share: f64) -> Self {
        let seconds = self.seconds * share;
        Self {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }

    /// Returns one of `parts` even parts of the share, from now on.
    pub(crate) fn part(self, parts: usize) -> Self {
        let seconds = self.seconds / parts.max(1) as f64;
        Self {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }
}

impl Budget {
    /// A budget for so many parts of each weight.
    pub(crate) fn new(total_s: f64, parts: &[(Weight, usize)]) -> Self {
        Self {
            total_s,
            stopwatch: Stopwatch::start(),
            charged_s: 0.0,
            parts: parts.iter().map(|(_, count)| count).sum(),
            begun: 0,
            weight: parts.iter().map(|(each, count)| each.value() * count).sum(),
            weight_begun: 0,
        }
    }

    /// Counts time of earlier starts of the program \[s\].
    pub(crate) fn charge(&mut self, spent_s: f64) {
        self.charged_s += spent_s;
    }

    /// Begins the next part and returns its share.
    pub(crate) fn next(&mut self, weight: Weight) -> Share {
        let weight = weight.value();
        let left = self.weight.saturating_sub(self.weight_begun).max(weight);
        self.begun += 1;
        self.weight_begun += weight;
        let spent_s = self.stopwatch.elapsed_s() + self.charged_s;
        let rest = (self.total_s - spent_s).max(0.0);
        let seconds = allowed(self.total_s, self.weight, left, weight, rest);
        Share {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }

    /// Returns the number of parts begun, and the number of all parts.
    pub(crate) fn progress(&self) -> (usize, usize) {
        (self.begun, self.parts)
    }
}

/// Returns the time that the next part may use \[s\], with weight `weight` of the remaining weight
/// `left`, from the remainder `rest_s` of the total for the weight `all`.
fn allowed(total_s: f64, all: usize, left: usize, weight: usize, rest_s: f64) -> f64 {
    let even = rest_s * weight as f64 / left as f64;
    let reserved = RESERVED_SHARE * total_s / all.max(1) as f64 * (left - weight) as f64;
    let most = (rest_s - reserved).max(even);
    (EVEN_SHARES_MAX * even).min(most).min(rest_s).max(LEAST_S)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Of 90 s, ten for each unit of weight: four times that at most, and half of it reserved for
    /// the other part.
    #[test]
    fn share_of_a_reference_is_that_of_its_weight() {
        let first = |weight| {
            let parts = [(Weight::Run, 1), (Weight::Reference, 1)];
            Budget::new(90.0, &parts).next(weight).seconds
        };
        assert!((first(Weight::Run) - 40.0).abs() < 0.1);
        assert!((first(Weight::Reference) - 85.0).abs() < 0.1);
    }

    proptest! {
        #[test]
        fn every_part_keeps_its_reserve_and_the_total_is_within_the_budget(
            parts in prop::collection::vec((0.0_f64..1.0, any::<bool>()), 1..300),
            // The parts up to this one use all of their share.
            greedy in 0_usize..300,
        ) {
            let weight = |heavy: bool| {
                let weight = if heavy { Weight::Reference } else { Weight::Run };
                weight.value()
            };
            let all: usize = parts.iter().map(|&(_, heavy)| weight(heavy)).sum();
            // Large enough for the least time of a part to be irrelevant.
            let total = all as f64;
            let (mut rest, mut left) = (total, all);
            for (n, &(used_share, heavy)) in parts.iter().enumerate() {
                let part_weight = weight(heavy);
                let seconds = allowed(total, all, left, part_weight, rest);
                prop_assert!(seconds >= RESERVED_SHARE * part_weight as f64 * (1.0 - 1e-9), "{n}: {seconds}");
                prop_assert!(seconds <= EVEN_SHARES_MAX * rest * part_weight as f64 / left as f64 + 1e-9);
                rest -= if n <= greedy { seconds } else { used_share * seconds };
                left -= part_weight;
                prop_assert!(rest >= -1e-9);
            }
        }
    }
}
