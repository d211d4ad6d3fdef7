//! Error of a measured value, by its values in other runs.

use twinrig_campaign::sweep::{ExpectationVerdict, RowExpectation};
use twinrig_rig::report::{ErrorBar, ErrorSource};
use twinrig_scenario::Expectation;

/// Factors of the distances of the first run, and of the last but one, from the finest.
const OF_FIRST: f64 = 1.5;
const OF_LAST_BUT_ONE: f64 = 10.0;

/// Factor of the deviation of other runs.
const OF_DEVIATION: f64 = 1.5;

/// Number of runs, the first included, by which values are expected to converge.
const FEW: usize = 3;

/// Least margin of a decided verdict, in errors.
const LEAST_MARGIN: f64 = 3.0;

/// An expectation in several runs; none in one that does not have it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Runs<'r> {
    /// In the run itself and at finer and finer settings.
    pub(super) finer: &'r [Option<&'r RowExpectation>],
    /// From perturbed starts.
    pub(super) perturbed: &'r [Option<&'r RowExpectation>],
    /// Expected ratio of the errors of two successive ones of the finer runs.
    pub(super) ratio: f64,
}

/// Returns the error bar of a plant without numerical error.
pub(super) fn exact(of: &Expectation) -> ErrorBar {
    ErrorBar {
        error: of.has_numerical_error().then_some(0.0),
        error_by: None,
        decided: true,
    }
}

impl Runs<'_> {
    /// Returns whether the error is open: the first of the finer runs do not converge, or `beyond`
    /// the horizon their convergence says nothing.
    pub(super) fn are_open(&self, of: &Expectation, beyond: bool) -> bool {
        of.has_numerical_error() && (beyond || !self.few().converge(of))
    }

    /// The first of the finer runs.
    fn few(&self) -> Self {
        let finer = self.finer.get(..FEW).unwrap_or(self.finer);
        Self { finer, ..*self }
    }

    /// Returns the error bar.
    pub(super) fn bar(&self, of: &Expectation, beyond: bool) -> ErrorBar {
        let refined = if self.are_open(of, beyond) {
            *self
        } else {
            self.few()
        };
        let is_predicted = !beyond && refined.converge(of) || self.perturbed.is_empty();
        let (error, by) = match (of.has_numerical_error(), is_predicted) {
            (false, _) => (None, ErrorSource::Refinement),
            (true, true) => (refined.bound(of), ErrorSource::Refinement),
            (true, false) => (self.deviation(of), ErrorSource::Ensemble),
        };
        let own = self.finer.first().copied().flatten();
        let is_within = match (own.and_then(|own| own.margin), error) {
            (Some(margin), Some(error)) => margin.abs() < LEAST_MARGIN * error,
            _ => false,
        };
        ErrorBar {
            error,
            error_by: error.map(|_| by),
            decided: of.is_of_method() || refined.have_same_verdict(is_predicted) && !is_within,
        }
    }

    /// Returns the values at finer and finer settings; none unless all runs have one.
    fn values(&self, of: &Expectation) -> Option<Vec<f64>> {
        let values = self.finer.iter().map(|&run| compared(run?, of));
        values.collect()
    }

    /// Returns whether the last difference of the values is as small as the method lets expect:
    /// its ratio to the greatest one is between that of the method and one.
    fn converge(&self, of: &Expectation) -> bool {
        let Some(values) = self.values(of) else {
            return false;
        };
        let pairs = values.windows(2);
        let mut differences = pairs.map(|pair| (pair[0] - pair[1]).abs());
        let last = differences.next_back();
        let greatest = differences.fold(0.0, f64::max);
        last.is_none_or(|last| last <= 0.5 * (1.0 + self.ratio) * greatest)
    }

    /// Returns the bound of the error by refinement.
    fn bound(&self, of: &Expectation) -> Option<f64> {
        let values = self.values(of)?;
        let (&finest, coarser) = values.split_last()?;
        let distance = |value: Option<&f64>| Some((value? - finest).abs());
        let [first, last] = [coarser.first(), coarser.last()].map(distance);
        Some(OF_FIRST * first? + OF_LAST_BUT_ONE * last?)
    }

    /// Returns the error by the root mean square deviation of the runs from perturbed starts, or by
    /// the greatest of the finer ones.
    fn deviation(&self, of: &Expectation) -> Option<f64> {
        let values = self.values(of)?;
        let (own, finer) = values.split_first()?;
        let squares = self.perturbed.iter().map(|&run| {
            let distance = compared(run?, of)? - own;
            Some(distance * distance)
        });
        let sum: Option<f64> = squares.sum();
        let deviation = libm::sqrt(sum? / self.perturbed.len() as f64);
        let finer = finer.iter().map(|value| (value - own).abs());
        Some(OF_DEVIATION * finer.fold(deviation, f64::max))
    }

    /// Returns whether the finer runs and, of a value that is not `predicted`, those from perturbed
    /// starts have the same verdict.
    fn have_same_verdict(&self, predicted: bool) -> bool {
        let perturbed = self.perturbed.iter().filter(|_| !predicted);
        let runs = self.finer.iter().chain(perturbed);
        let mut verdicts = runs.map(|run| run.map(|run| run.verdict));
        let first = verdicts.next();
        verdicts.all(|verdict| Some(verdict) == first)
    }
}

/// Returns the number of a run that others are compared with: the measured value, or the margin
/// where legs, footsteps or instants compete for the least one. Of those the value jumps where
/// another one wins, the margin does not.
fn compared(run: &RowExpectation, of: &Expectation) -> Option<f64> {
    if of.is_of_one_number() || run.verdict == ExpectationVerdict::Unobserved {
        run.measured
    } else {
        run.margin
    }
}
