//! Search along an axis: sizes to be tested, as a function of those that are.

use super::axis::{AxisValues, legible};

/// Greatest distance of neighbouring tested sizes below a radius, as a share of the range of the
/// axis, and of the radius: every wider window of failures contains a tested size.
const RANGE_SHARE: f64 = 1.0 / 15.0;
const RADIUS_SHARE: f64 = 0.25;
/// Share of that distance which gaps are divided into: sizes are rounded, and distances with them.
const BEFORE_ROUNDING: f64 = 0.95;
/// Greatest precision that sizes in gaps are rounded by: coarser ones would move them too far.
const GAP_PRECISION: f64 = 0.01;
/// Least size that is tested, as a share of the greatest.
const LEAST: f64 = 1e-6;
/// Greatest number of sizes of an axis: a bound for expectations that fail at random.
const SIZES_MOST: usize = 400;

/// Outcome of an expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Whether it was observed.
    pub is_observed: bool,
    /// Whether the run may pass with it: satisfied, or optional and not observed.
    pub holds: bool,
    /// Distance to the bound; negative if it is violated.
    pub margin: Option<f64>,
}

/// Outcome of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum RunOutcome {
    /// Outcomes of the expectations, in their order.
    Judged(Vec<Observation>),
    /// An error ended the run: no expectation holds.
    Ended(String),
    /// The scenario is not valid with this value.
    Refused(String),
}

/// Size of a disturbance with the outcome of its run.
#[derive(Clone, Debug, PartialEq)]
pub struct TestedSize {
    /// The size.
    pub size: f64,
    /// The outcome.
    pub outcome: RunOutcome,
}

impl TestedSize {
    /// Returns whether an expectation holds.
    pub(super) fn holds(&self, expectation: usize) -> bool {
        match &self.outcome {
            RunOutcome::Judged(outcomes) => outcomes.get(expectation).is_some_and(|it| it.holds),
            RunOutcome::Ended(_) | RunOutcome::Refused(_) => false,
        }
    }

    fn is_refused(&self) -> bool {
        matches!(self.outcome, RunOutcome::Refused(_))
    }
}

/// Sizes between which an expectation fails first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bracket {
    /// Greatest size below the first failure; the expectation holds there.
    pub holds: f64,
    /// Least size at which it fails.
    pub fails: f64,
}

/// Search along an axis. The sizes that it proposes are a function of the outcomes of those before,
/// in whatever order these arrive.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisSearch {
    values: AxisValues,
    /// Number of expectations.
    expectations: usize,
    precision: f64,
    /// In ascending order.
    tested: Vec<TestedSize>,
}

impl AxisSearch {
    /// Creates a search for so many expectations; brackets are closed when their width is at most
    /// `precision` times their upper end.
    pub fn new(values: AxisValues, expectations: usize, precision: f64) -> Self {
        Self {
            values,
            expectations,
            precision,
            tested: Vec::new(),
        }
    }

    /// Adds the outcome of the run of a size. An outcome of a size that has one is ignored.
    pub fn add(&mut self, size: f64, outcome: RunOutcome) {
        let place = self.tested.binary_search_by(|it| it.size.total_cmp(&size));
        if let Err(index) = place {
            self.tested.insert(index, TestedSize { size, outcome });
        }
    }

    /// Returns the sizes with their outcomes, in ascending order.
    pub fn tested(&self) -> &[TestedSize] {
        &self.tested
    }

    /// Returns the precision.
    pub fn precision(&self) -> f64 {
        self.precision
    }

    /// Returns whether the search ended for the number of its runs.
    pub fn is_exhausted(&self) -> bool {
        self.tested.len() >= SIZES_MOST
    }

    /// Returns the sizes to be tested next, in ascending order; none at the end of the search.
    pub fn next_sizes(&self) -> Vec<f64> {
        if self.is_exhausted() {
            return Vec::new();
        }
        let is_new = |size: &f64| self.tested.iter().all(|it| it.size != *size);
        let grid = self.values.sizes(self.precision);
        let missing: Vec<f64> = grid.into_iter().filter(is_new).collect();
        if !missing.is_empty() {
            return missing;
        }
        let mut brackets: Vec<Bracket> = self.refused().into_iter().collect();
        let searched = (0..self.expectations).filter(|&one| self.is_searched(one));
        let searched: Vec<usize> = searched.collect();
        brackets.extend(searched.iter().filter_map(|&one| self.bracket(one)));
        let mut sizes: Vec<f64> = brackets
            .into_iter()
            .filter_map(|it| self.middle(it))
            .collect();
        sizes.sort_by(f64::total_cmp);
        sizes.dedup();
        if sizes.is_empty() {
            self.in_gaps(&searched)
        } else {
            sizes
        }
    }

    /// Returns the reason why the scenario is not valid with any disturbance.
    pub fn invalid(&self) -> Option<&str> {
        match self.tested.get(1).map(|it| &it.outcome) {
            Some(RunOutcome::Refused(reason)) => Some(reason),
            _ => None,
        }
    }

    /// Returns the size of the greatest disturbance with which the scenario is valid.
    pub(super) fn end(&self) -> f64 {
        let greatest = self.values.greatest();
        self.refused().map_or(greatest, |bracket| bracket.holds)
    }

    /// Returns the sizes between which the scenario becomes invalid.
    pub(super) fn refused(&self) -> Option<Bracket> {
        let first = self.tested.iter().position(TestedSize::is_refused)?;
        Some(Bracket {
            holds: self.tested[first.saturating_sub(1)].size,
            fails: self.tested[first].size,
        })
    }

    /// Returns whether an expectation has a radius: it is observed and holds without a disturbance.
    pub(super) fn is_searched(&self, expectation: usize) -> bool {
        let first = self.tested.first().map(|it| &it.outcome);
        let Some(RunOutcome::Judged(outcomes)) = first else {
            return false;
        };
        let outcome = outcomes.get(expectation);
        outcome.is_some_and(|it| it.is_observed && it.holds)
    }

    /// Returns the sizes with which the scenario is valid.
    pub(super) fn valid(&self) -> &[TestedSize] {
        let first = self.tested.iter().position(TestedSize::is_refused);
        &self.tested[..first.unwrap_or(self.tested.len())]
    }

    /// Returns the sizes between which an expectation fails first; none if it does not.
    pub(super) fn bracket(&self, expectation: usize) -> Option<Bracket> {
        let valid = self.valid();
        let first = valid.iter().position(|it| !it.holds(expectation))?;
        let below = valid.get(first.checked_sub(1)?)?;
        Some(Bracket {
            holds: below.size,
            fails: valid[first].size,
        })
    }

    /// Returns a size that halves the bracket; none if it is narrow enough.
    fn middle(&self, Bracket { holds, fails }: Bracket) -> Option<f64> {
        let is_closed =
            fails - holds <= self.precision * fails || fails <= LEAST * self.values.greatest();
        let middle = legible(0.5 * (holds + fails), self.precision);
        (!is_closed && middle > holds && middle < fails).then_some(middle)
    }

    /// Returns sizes in the gaps below the radius of each expectation: a failure there is the first
    /// one. An expectation that does not fail has gaps up to the end of the axis.
    fn in_gaps(&self, searched: &[usize]) -> Vec<f64> {
        let mut known: Vec<f64> = self.tested.iter().map(|it| it.size).collect();
        let tested = known.len();
        for &one in searched {
            let below = self.below(one);
            let widest = (RANGE_SHARE * self.end()).min(RADIUS_SHARE * below);
            if below <= LEAST * self.values.greatest() {
                continue;
            }
            let inside: Vec<f64> = known.iter().copied().filter(|it| *it <= below).collect();
            for ends in inside.windows(2) {
                let &[from, to] = ends else { continue };
                if to - from <= widest {
                    continue;
                }
                let parts = ((to - from) / (BEFORE_ROUNDING * widest)).ceil();
                let mut part = 1.0;
                while part < parts {
                    let size = from + (to - from) * part / parts;
                    let size = legible(size, self.precision.min(GAP_PRECISION));
                    if size > from && size < to {
                        known.push(size);
                    }
                    part += 1.0;
                }
            }
            known.sort_by(f64::total_cmp);
            known.dedup();
        }
        if known.len() == tested {
            return Vec::new();
        }
        let is_new = |size: &f64| self.tested.iter().all(|it| it.size != *size);
        known.into_iter().filter(is_new).collect()
    }

    /// Returns the greatest size below the first failure of an expectation, or the end of the axis.
    fn below(&self, expectation: usize) -> f64 {
        self.bracket(expectation).map_or(self.end(), |it| it.holds)
    }

    /// Returns the greatest distance of neighbouring tested sizes below the first failure of an
    /// expectation: a narrower window of failures may have been missed there.
    pub(super) fn resolution(&self, expectation: usize) -> f64 {
        let below = self.below(expectation);
        let sizes = self.valid().iter().map(|it| it.size);
        let sizes: Vec<f64> = sizes.filter(|size| *size <= below).collect();
        let gaps = sizes.windows(2).map(|ends| ends[1] - ends[0]);
        gaps.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig_kernel::Unit;

    use super::*;
    use crate::radius::AxisGrid;

    /// Searches with expectations that hold at some sizes.
    fn found(
        values: AxisValues,
        precision: f64,
        holds: &[&dyn Fn(f64) -> bool],
        valid_to: f64,
    ) -> AxisSearch {
        let mut search = AxisSearch::new(values, holds.len(), precision);
        loop {
            let mut sizes = search.next_sizes();
            if sizes.is_empty() {
                return search;
            }
            // The order of their ends has no influence.
            sizes.reverse();
            for size in sizes {
                let outcome = |holds: &&dyn Fn(f64) -> bool| Observation {
                    is_observed: true,
                    holds: holds(size),
                    margin: None,
                };
                search.add(
                    size,
                    if size > valid_to {
                        RunOutcome::Refused("too much".to_owned())
                    } else {
                        RunOutcome::Judged(holds.iter().map(outcome).collect())
                    },
                );
            }
        }
    }

    fn values(limit: f64, grid: AxisGrid) -> AxisValues {
        AxisValues {
            nominal: 0.0,
            limit,
            unit: Unit::One,
            grid,
        }
    }

    fn any_grid() -> impl Strategy<Value = AxisGrid> {
        prop_oneof![Just(AxisGrid::Linear), Just(AxisGrid::Geometric)]
    }

    proptest! {
        /// The bracket contains the threshold and has the precision, wherever the threshold is, for
        /// each expectation by itself; the scenario's own bound is found likewise.
        #[test]
        fn thresholds_are_found_with_the_precision(
            limit in 1e-6..1e6_f64,
            shares in prop::array::uniform2(1e-3..0.999_f64),
            valid in 0.01..1.5_f64,
            precision in 1e-4..0.1_f64,
            grid in any_grid(),
        ) {
            let [one, other] = shares.map(|share| share * limit);
            let holds: [&dyn Fn(f64) -> bool; 2] = [&|size| size < one, &|size| size < other];
            let search = found(values(limit, grid), precision, &holds, valid * limit);
            prop_assert!(!search.is_exhausted());
            let end = search.end();
            prop_assert!(end <= valid * limit && end >= (valid * limit).min(limit) * (1.0 - precision));
            for (index, threshold) in [one, other].into_iter().enumerate() {
                match search.bracket(index) {
                    Some(Bracket { holds, fails }) => {
                        prop_assert!(holds < threshold && threshold <= fails);
                        prop_assert!(fails - holds <= precision * fails);
                    }
                    None => prop_assert!(threshold > end),
                }
            }
        }

        /// A window of failures as wide as a fifteenth of the range contains a tested size,
        /// wherever it is and in both directions, and its lower end is the radius; so does one as
        /// wide as a quarter of the radius.
        #[test]
        fn windows_of_failures_below_are_found(
            from in 0.001..0.999_f64, width in 0.0667..0.3_f64, end in 0.01..1.0_f64,
            precision in 1e-4..0.1_f64, of_radius: bool, grid in any_grid(), is_up: bool,
        ) {
            let end = if of_radius { end } else { 1.0 };
            let share = if of_radius { width + 0.19 } else { width };
            let (from, to) = (from * end, (from + share) * end);
            let holds = |size: f64| size < from || (size >= to && size < end);
            let range = values(if is_up { 1.0 } else { -1.0 }, grid);
            let search = found(range, precision, &[&holds], 2.0);
            let Bracket { holds, fails } = search.bracket(0).unwrap();
            prop_assert!(holds < from && from <= fails, "{holds} {fails}");
            prop_assert!(fails - holds <= precision * fails);
        }

        /// The resolution is the width of the widest window that no tested size is in, and within
        /// the promised share of the range.
        #[test]
        fn resolution_is_the_widest_window_that_could_be_missed(
            limit in 1e-6..1e6_f64, threshold in 1e-3..1.5_f64, precision in 1e-4..0.5_f64,
            grid in any_grid(),
        ) {
            let holds = |size: f64| size < threshold * limit;
            let search = found(values(limit, grid), precision, &[&holds], f64::INFINITY);
            let resolution = search.resolution(0);
            let below = search.bracket(0).map_or(limit, |it| it.holds);
            prop_assert!(resolution > 0.0 && resolution <= RANGE_SHARE * limit);
            prop_assert!(resolution <= RADIUS_SHARE * below);
            let sizes: Vec<f64> = search.tested().iter().map(|it| it.size).collect();
            let is_gap = |ends: &[f64]| ends[1] <= below && ends[1] - ends[0] == resolution;
            prop_assert!(sizes.windows(2).any(is_gap));
        }

        /// Outcomes at random end the search, too.
        #[test]
        fn search_ends_whatever_the_outcomes(seed: u64, share in 0.0..1.0_f64) {
            let holds = |size: f64| {
                let mut numbers = twinrig_kernel::stream(seed, &size.to_string());
                size == 0.0 || numbers.unit() < share
            };
            let search = found(values(1.0, AxisGrid::Geometric), 0.01, &[&holds], 2.0);
            prop_assert!(search.tested().len() <= SIZES_MOST + 20);
            let first = search.tested().iter().find(|it| !it.holds(0)).map(|it| it.size);
            prop_assert_eq!(search.bracket(0).map(|it| it.fails), first);
        }
    }
}
