//! Numerical errors of the measured values of a run, by runs of the same scene at finer settings.
//!
//! A run is repeated at a tenth of the tolerance and half the step, and again at a tenth and half
//! of those. With d₁ and d₂ the differences of successive margins, and r the ratio of successive
//! errors that the method should have, the error of the first run is (d₁ + …) ≤ max(d₁, d₂)/(1 − r)
//! where it falls at least so fast. Three times that is the bound: errors of gaits follow the
//! tolerance in the mean, not one by one. d₂ counts because d₁ alone may vanish by chance.
//! `benches/error-bars` compares bounds with true errors.
//!
//! Where d₂ is not clearly less than d₁, and where the scenario says that its horizon of
//! predictability is before the end of the window, the finer runs may be other draws of a motion
//! that no run predicts. There the error is at least the root mean square deviation of runs from
//! perturbed starts.

use twinrig_campaign::spread::Magnitude;
use twinrig_campaign::sweep::{ExpectationVerdict, RowExpectation, SweepRow};
use twinrig_kernel::SimTime;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::refinement::Refined;
use twinrig_rig::error::guarded;
use twinrig_rig::report::{ErrorBar, ErrorSource, Report, Status, row};
use twinrig_rig::run::interrupt;
use twinrig_scenario::{Expectation, Varied};

use crate::ensemble::{Ensemble, ran, row_of};
use crate::error::{Error, StudyError};
use crate::parallel::{RunResult, run_all};

/// Refinements.
const REFINEMENTS: u32 = 2;

/// Bound of an error over the estimate by the ratio of successive errors.
const SAFETY: f64 = 3.0;

/// Greatest ratio of successive differences of values that converge, between that of the method and
/// one.
fn greatest_ratio(of_method: f64) -> f64 {
    0.5 * (1.0 + of_method)
}

/// Runs of the ensemble, and the greatest change of a coordinate of their starts \[m, rad\]: about
/// the error of a step.
const MEMBERS: usize = 8;
const MAGNITUDE: Magnitude = Magnitude::UpTo(1e-6);

/// Least margin of a decided verdict, in errors.
const LEAST_MARGIN: f64 = 3.0;

/// Adds the numerical error of each measured value to the report of an unperturbed run. After a run
/// with an error nothing is added. `progress` receives the number of runs that have ended, and of
/// all.
///
/// # Errors
/// A plant whose settings of the numerical error are not known, parts that cannot be built, or
/// threads that cannot be started.
pub fn with_error_bars(
    assembly: &Assembly<'_>,
    mut report: Report,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Report, Error> {
    if report.error.is_some() {
        return Ok(report);
    }
    let first = row::of_report(report.clone());
    let found = bars(assembly, &first, progress);
    match found {
        Ok(bars) => {
            for (line, bar) in report.expectations.iter_mut().zip(bars) {
                line.error_bar = Some(bar);
            }
            Ok(report)
        }
        Err(Failure::Of(error)) => Err(error),
        Err(Failure::Ended(why)) => {
            report.error = Some(why);
            report.verdict = Status::Error;
            Ok(report)
        }
    }
}

/// Reason for which there are no errors.
enum Failure {
    /// A run could not start.
    Of(Error),
    /// A run ended early, or the runs were interrupted.
    Ended(String),
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Of(error.into())
    }
}

fn bars(
    assembly: &Assembly<'_>,
    first: &SweepRow,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<ErrorBar>, Failure> {
    let refined = (1..=REFINEMENTS).map(|times| assembly.refined(times));
    let refined: Option<Vec<Refined<'_>>> = refined.collect::<Result<_, _>>()?;
    let expectations = &assembly.scenario().expectations;
    let Some(refined) = refined else {
        let exact = |of: &Expectation| ErrorBar {
            error: of.has_numerical_error().then_some(0.0),
            error_by: None,
            decided: true,
        };
        return Ok(expectations.iter().map(exact).collect());
    };
    let ratio = refined.first().map_or(0.5, |it| it.ratio);
    let file = &assembly.scenario().file;
    let run = |index: usize| {
        let scene = refined.get(index).map(|it| &it.assembly);
        let row = scene.map(|scene| guarded(file, || row_of(scene, None)));
        row.map_or_else(|| Err("no such run".to_owned()), ran)
    };
    let finer = runs(file, refined.len(), &run, progress)?;
    let values = |index: usize| -> Vec<Option<&RowExpectation>> {
        let rows = std::iter::once(first).chain(&finer);
        rows.map(|row| row.expectations.get(index)).collect()
    };
    let estimates = expectations.iter().enumerate();
    let estimates: Vec<Estimate> = estimates
        .map(|(index, of)| Estimate::of(&values(index), ratio, of))
        .collect();
    let unpredictable = |(of, estimate): (&Expectation, &Estimate)| {
        of.has_numerical_error() && (!estimate.converges || is_beyond_horizon(assembly, of))
    };
    let unpredictable = expectations.iter().zip(&estimates).map(unpredictable);
    let unpredictable: Vec<bool> = unpredictable.collect();
    let deviations = if unpredictable.contains(&true) {
        deviations(assembly, first, progress)?
    } else {
        None
    };
    let bars = estimates.iter().enumerate().map(|(index, estimate)| {
        let deviation = deviations.as_ref().filter(|_| unpredictable[index]);
        estimate.bar(deviation.map(|all| all[index]), &expectations[index])
    });
    Ok(bars.collect())
}

/// Whether an expectation is judged past the horizon of predictability that its scenario names.
fn is_beyond_horizon(assembly: &Assembly<'_>, of: &Expectation) -> bool {
    let scenario = assembly.scenario();
    let until = of.before.unwrap_or(scenario.end());
    let horizon = scenario.horizon.map(|horizon| SimTime::ZERO + horizon);
    horizon.is_some_and(|horizon| until > horizon)
}

/// Does runs, all of which have to reach their end.
fn runs(
    file: &str,
    count: usize,
    run: &(dyn Fn(usize) -> RunResult<SweepRow> + Sync),
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<SweepRow>, Failure> {
    let rows = run_all(count, run, &mut |done, _| {
        progress(done, count);
        !interrupt::is_requested()
    });
    let rows = rows.map_err(|source| match source {
        StudyError::Interrupted { .. } => Failure::Ended(format!("the error bars were {source}")),
        source => Failure::Of(Error::Study {
            file: file.to_owned(),
            source,
        }),
    })?;
    let rows = rows.into_iter().map(|row| {
        let row = row.unwrap_or_else(SweepRow::of_error);
        match &row.error {
            None => Ok(row),
            Some(why) => Err(Failure::Ended(format!(
                "a run of the error bars has an error: {why}"
            ))),
        }
    });
    rows.collect()
}

/// Error of a measured value from runs at finer settings.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate {
    /// Margin of the run itself.
    margin: Option<f64>,
    /// Bound of the error; none if the value is not observed in all runs.
    bound: Option<f64>,
    /// Whether the differences of the runs fall as the method lets expect.
    converges: bool,
    /// Whether all runs have the same verdict.
    same_verdict: bool,
}

impl Estimate {
    /// Estimates from the run itself and those at finer settings.
    fn of(runs: &[Option<&RowExpectation>], ratio: f64, expectation: &Expectation) -> Self {
        let verdicts = |one: Option<&RowExpectation>| one.map(|one| one.verdict);
        let first = runs.first().copied().flatten();
        let same_verdict = runs.iter().all(|&one| verdicts(one) == verdicts(first));
        let values: Option<Vec<f64>> = runs.iter().map(|&one| compared(one?)).collect();
        let differences = values.map(|values| {
            let pairs = values.windows(2);
            pairs.map(|pair| (pair[0] - pair[1]).abs()).collect()
        });
        let differences: Option<Vec<f64>> = differences;
        let greatest = |all: &[f64]| all.iter().copied().fold(0.0, f64::max);
        let falls = |all: &[f64]| {
            let pairs = all.windows(2);
            pairs
                .into_iter()
                .all(|pair| pair[1] <= greatest_ratio(ratio) * pair[0])
        };
        Self {
            margin: first.and_then(|one| one.margin),
            bound: differences
                .as_deref()
                .map(|all| SAFETY * greatest(all) / (1.0 - ratio))
                .filter(|_| expectation.has_numerical_error()),
            converges: differences.as_deref().is_some_and(falls),
            same_verdict: same_verdict || expectation.is_of_method(),
        }
    }

    /// Returns the error, also by the deviation of an ensemble and its verdicts if there is one.
    fn bar(&self, ensemble: Option<Deviation>, of: &Expectation) -> ErrorBar {
        let same_verdict = ensemble.is_none_or(|it| it.same_verdict) || of.is_of_method();
        let deviation = ensemble.and_then(|it| it.value);
        let (error, error_by) = match (self.bound, deviation) {
            (None, _) => (None, None),
            (Some(bound), Some(deviation)) if deviation > bound => {
                (Some(deviation), Some(ErrorSource::Ensemble))
            }
            (Some(bound), _) => (Some(bound), Some(ErrorSource::Refinement)),
        };
        let within = match (self.margin, error) {
            (Some(margin), Some(error)) => margin.abs() < LEAST_MARGIN * error,
            _ => false,
        };
        ErrorBar {
            error,
            error_by,
            decided: self.same_verdict && same_verdict && !within,
        }
    }
}

/// Returns the number of a run that others are compared with: the margin, which is continuous where
/// the nearest limit changes from one side to the other.
fn compared(one: &RowExpectation) -> Option<f64> {
    match one.verdict {
        ExpectationVerdict::Unobserved => one.measured,
        ExpectationVerdict::Pass | ExpectationVerdict::Fail => one.margin,
    }
}

/// Deviation of the runs from perturbed starts from the run itself.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Deviation {
    /// Root mean square; none if the value is not observed in all runs.
    value: Option<f64>,
    /// Whether all runs have the verdict of the run itself.
    same_verdict: bool,
}

/// Returns the deviations of the expectations over runs from perturbed starts; none if the plant
/// cannot be perturbed.
fn deviations(
    assembly: &Assembly<'_>,
    first: &SweepRow,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Option<Vec<Deviation>>, Failure> {
    let mut ensemble = Ensemble::new(assembly, MEMBERS + 1, Varied::Start)?;
    if ensemble.why_seeds().is_some() {
        return Ok(None);
    }
    ensemble.perturb_by(MAGNITUDE);
    let run = |index: usize| ran(ensemble.run(index + 1, None));
    let file = &assembly.scenario().file;
    let rows = runs(file, MEMBERS, &run, progress)?;
    let deviation = |(index, own): (usize, &RowExpectation)| {
        let others = rows.iter().map(|row| row.expectations.get(index));
        let others: Vec<Option<&RowExpectation>> = others.collect();
        let squares = others.iter().map(|&one| {
            let distance = compared(one?)? - compared(own)?;
            Some(distance * distance)
        });
        let sum: Option<f64> = squares.sum();
        let same = |one: &Option<&RowExpectation>| one.is_some_and(|it| it.verdict == own.verdict);
        Deviation {
            value: sum.map(|sum| libm::sqrt(sum / others.len() as f64)),
            same_verdict: others.iter().all(same),
        }
    };
    let all = first.expectations.iter().enumerate();
    Ok(Some(all.map(deviation).collect()))
}

#[cfg(test)]
mod tests;
