//! Error of a measured value, by its values in other runs.

use twinrig_campaign::sweep::{ExpectationVerdict, RowExpectation};
use twinrig_rig::report::{ErrorBar, ErrorSource};
use twinrig_scenario::ValueKind;

/// Factors of the distances of the first run, and of the last but one, from the finest.
const OF_FIRST: f64 = 1.5;
const OF_LAST_BUT_ONE: f64 = 10.0;

/// Factor of the deviation of other runs.
const OF_DEVIATION: f64 = 2.0;

/// Number of runs, the first included, by which values are expected to converge.
const FEW: usize = 3;

/// Least margin of a decided verdict, in errors.
const LEAST_MARGIN: f64 = 3.0;

/// An expectation in several runs; none in one that does not have it.
#[derive(Clone, Debug)]
pub(super) struct Runs {
    /// Kind of the measured value.
    pub(super) kind: ValueKind,
    /// Whether it is judged past the horizon of predictability.
    pub(super) beyond: bool,
    /// In the run itself and at finer and finer settings.
    pub(super) finer: Vec<Option<RowExpectation>>,
    /// From perturbed starts.
    pub(super) perturbed: Vec<Option<RowExpectation>>,
    /// Expected ratio of the errors of two successive ones of the finer runs.
    pub(super) ratio: f64,
}

/// Returns the error bar of a plant without numerical error.
pub(super) fn exact(kind: ValueKind) -> ErrorBar {
    ErrorBar {
        error: kind.has_error().then_some(0.0),
        error_by: None,
        decided: true,
    }
}

impl Runs {
    /// Returns whether the error is open: the first of the finer runs do not converge, or past the
    /// horizon their convergence says nothing.
    pub(super) fn are_open(&self) -> bool {
        self.kind.has_error() && !self.few().are_predictable()
    }

    /// The first of the finer runs.
    fn few(&self) -> Self {
        let mut few = self.clone();
        few.finer.truncate(FEW);
        few
    }

    fn are_predictable(&self) -> bool {
        !self.beyond && self.converge()
    }

    /// Returns the error bar.
    pub(super) fn bar(&self) -> ErrorBar {
        if self.kind == ValueKind::OfMethod {
            return exact(self.kind);
        }
        let refined = if self.are_open() {
            self.clone()
        } else {
            self.few()
        };
        let is_predictable = refined.are_predictable();
        let by = if is_predictable || self.perturbed.is_empty() {
            ErrorSource::Refinement
        } else {
            ErrorSource::Ensemble
        };
        let error = match by {
            _ if !self.kind.has_error() => None,
            ErrorSource::Refinement => refined.bound(),
            ErrorSource::Ensemble => refined.deviation(),
        };
        // A plant that cannot be perturbed decides nothing that it does not predict.
        let is_known = is_predictable || !self.perturbed.is_empty() || !self.kind.has_error();
        ErrorBar {
            error,
            error_by: error.map(|_| by),
            decided: is_known && refined.have_same_verdict(by) && !self.is_within(error),
        }
    }

    /// Whether the margin of the run itself is less than the least of a decided verdict.
    fn is_within(&self, error: Option<f64>) -> bool {
        let own = self.finer.first().and_then(Option::as_ref);
        let margin = own.and_then(|own| own.margin);
        margin
            .zip(error)
            .is_some_and(|(margin, error)| margin.abs() < LEAST_MARGIN * error)
    }

    /// Returns the values at finer and finer settings; none unless all runs have one.
    fn values(&self) -> Option<Vec<f64>> {
        let values = self.finer.iter().map(|run| self.compared(run.as_ref()?));
        values.collect()
    }

    /// Returns whether the last difference of the values is as small as the method lets expect:
    /// its ratio to the greatest one is between that of the method and one. A value that no run has
    /// does not change.
    fn converge(&self) -> bool {
        let Some(values) = self.values() else {
            let mut runs = self.finer.iter().flatten();
            return runs.all(|run| self.compared(run).is_none());
        };
        let pairs = values.windows(2);
        let mut differences = pairs.map(|pair| (pair[0] - pair[1]).abs());
        let last = differences.next_back();
        let greatest = differences.fold(0.0, f64::max);
        last.is_none_or(|last| last <= 0.5 * (1.0 + self.ratio) * greatest)
    }

    /// Returns the bound of the error by refinement.
    fn bound(&self) -> Option<f64> {
        let values = self.values()?;
        let (&finest, coarser) = values.split_last()?;
        let distance = |value: Option<&f64>| Some((value? - finest).abs());
        let [first, last] = [coarser.first(), coarser.last()].map(distance);
        Some(OF_FIRST * first? + OF_LAST_BUT_ONE * last?)
    }

    /// Returns the error by the root mean square deviation of the runs from perturbed starts, or by
    /// the greatest of the finer ones.
    fn deviation(&self) -> Option<f64> {
        let values = self.values()?;
        let (own, finer) = values.split_first()?;
        let squares = self.perturbed.iter().map(|run| {
            let distance = self.compared(run.as_ref()?)? - own;
            Some(distance * distance)
        });
        let sum: Option<f64> = squares.sum();
        let deviation = libm::sqrt(sum? / self.perturbed.len() as f64);
        let finer = finer.iter().map(|value| (value - own).abs());
        Some(OF_DEVIATION * finer.fold(deviation, f64::max))
    }

    /// Returns whether finer runs and, of an ensemble, those from perturbed starts have the same
    /// verdict.
    fn have_same_verdict(&self, by: ErrorSource) -> bool {
        let perturbed = self.perturbed.iter();
        let perturbed = perturbed.filter(|_| by == ErrorSource::Ensemble);
        let runs = self.finer.iter().chain(perturbed);
        let mut verdicts = runs.map(|run| run.as_ref().map(|run| run.verdict));
        let first = verdicts.next();
        verdicts.all(|verdict| Some(verdict) == first)
    }

    /// Returns the number of a run that others are compared with: the measured value, or the margin
    /// where legs, footsteps or instants compete for the least one. Of those the value jumps where
    /// another one wins, the margin does not.
    fn compared(&self, run: &RowExpectation) -> Option<f64> {
        match (self.kind, run.verdict) {
            (ValueKind::Single, _) | (_, ExpectationVerdict::Unobserved) => run.measured,
            _ => run.margin,
        }
    }
}
