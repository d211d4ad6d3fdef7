//! How long a study may take, and each of its parts.

use twinrig_runtime::interrupt;

use crate::error::StudyError;
use crate::stopwatch::{Deadline, Stopwatch};

/// A part may take so many times its even share of what is left: most take less.
const GENEROSITY: f64 = 4.0;
/// However much those before it take, a part is left this share of what an even one of the whole would be: what is slow, or comes
/// first, does not starve what is to come.
const KEPT: f64 = 0.5;
/// No part gets less than this \[s\]: enough for what is quick, and little enough for hundreds of parts after time is up.
const LEAST_S: f64 = 0.02;

/// What all else is measured against, or takes many times as long as a row, is worth so many parts.
const HEAVY: usize = 8;

/// The time of a study, shared out among its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    total_s: f64,
    watch: Stopwatch,
    parts: usize,
    begun: usize,
    /// The same with heavy parts counted for as many as they are worth.
    worth: usize,
    worth_begun: usize,
}

/// What a part may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share {
    /// \[s\]
    pub(crate) seconds: f64,
    pub(crate) deadline: Deadline,
}

impl Share {
    /// One of `parts` even parts of it, from now on.
    pub(crate) fn part(self, parts: usize) -> Self {
        let seconds = self.seconds / parts.max(1) as f64;
        Self {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }
}

impl Budget {
    /// For so many parts, of which so many are heavy.
    pub(crate) fn new(total_s: f64, parts: usize, heavy: usize) -> Self {
        Self {
            total_s,
            watch: Stopwatch::start(),
            parts,
            begun: 0,
            worth: parts + heavy * (HEAVY - 1),
            worth_begun: 0,
        }
    }

    /// The share of the next part, a heavy one or not.
    pub(crate) fn next(&mut self, heavy: bool) -> Share {
        let worth = if heavy { HEAVY } else { 1 };
        let left = self.worth.saturating_sub(self.worth_begun).max(worth);
        self.begun += 1;
        self.worth_begun += worth;
        let rest = (self.total_s - self.watch.elapsed_s()).max(0.0);
        let seconds = allowed(self.total_s, self.worth, left, worth, rest);
        Share {
            seconds,
            deadline: Deadline::within(seconds),
        }
    }

    /// That the last part came to its end.
    ///
    /// # Errors
    /// The program is to end: what the last parts found is not what they would have found.
    pub(crate) fn finished(&self) -> Result<(), StudyError> {
        let (done, of) = self.progress();
        if interrupt::is_requested() {
            return Err(StudyError::Interrupted { done, of });
        }
        Ok(())
    }

    /// How many parts have begun, and of how many.
    pub(crate) fn progress(&self) -> (usize, usize) {
        (self.begun, self.parts)
    }
}

/// What the next part, worth `worth` of the `left` ones, may take of the `rest` of a budget for `all` of them \[s\].
fn allowed(total_s: f64, all: usize, left: usize, worth: usize, rest_s: f64) -> f64 {
    let even = rest_s * worth as f64 / left as f64;
    let kept = KEPT * total_s / all.max(1) as f64 * (left - worth) as f64;
    let most = (rest_s - kept).max(even);
    (GENEROSITY * even).min(most).min(rest_s).max(LEAST_S)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_part_is_starved_by_those_before_it_and_all_stay_within_the_budget(
            parts in prop::collection::vec((0.0_f64..1.0, any::<bool>()), 1..300),
            // The first so many take all they may.
            greedy in 0_usize..300,
        ) {
            let worth = |heavy: bool| if heavy { HEAVY } else { 1 };
            let all: usize = parts.iter().map(|&(_, heavy)| worth(heavy)).sum();
            // Enough for the least of each to be no matter.
            let total = all as f64;
            let (mut rest, mut left) = (total, all);
            for (n, &(greed, heavy)) in parts.iter().enumerate() {
                let own = worth(heavy);
                let seconds = allowed(total, all, left, own, rest);
                prop_assert!(seconds >= KEPT * own as f64 * (1.0 - 1e-9), "{n}: {seconds}");
                prop_assert!(seconds <= GENEROSITY * rest * own as f64 / left as f64 + 1e-9);
                rest -= if n <= greedy { seconds } else { greed * seconds };
                left -= own;
                prop_assert!(rest >= -1e-9);
            }
        }
    }
}
