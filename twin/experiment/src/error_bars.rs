//! Numerical errors of the measured values of a run, by runs of the same scene at finer settings.
//!
//! A run is repeated at a tenth of the tolerance and half the step, and again at a tenth and half
//! of those. With the values v₀, v₁ and v₂ of the three runs, the error of the first is
//!
//! ```text
//! 1.5 |v₀ − v₂| + 10 |v₁ − v₂|
//! ```
//!
//! The first term is the error where the finest run is exact, the second is about that of the run
//! before it, which the finest one has less of. Errors of gaits follow the tolerance in the mean,
//! not one by one: the factors are such that 99 of 100 errors are at least the true ones
//! (`benches/error-bars`).
//!
//! Where |v₁ − v₂| is not clearly less than |v₀ − v₁|, a third refinement tells whether that is by
//! chance, and takes the place of the second. Where it is not, and where the scenario says that its
//! horizon of predictability is before the end of the window, the finer runs are other draws of a
//! motion that no run predicts. The error is then twice the root mean square deviation of runs
//! from perturbed starts, or that of the farthest finer run.

mod estimate;

use twinrig_campaign::spread::Magnitude;
use twinrig_campaign::sweep::{RowExpectation, SweepRow};
use twinrig_kernel::SimTime;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::refinement::Refined;
use twinrig_rig::error::guarded;
use twinrig_rig::report::{ErrorBar, Report, Status, row};
use twinrig_rig::run::interrupt;
use twinrig_scenario::{Expectation, Varied};

use crate::ensemble::{Ensemble, ran, row_of};
use crate::error::{Error, StudyError};
use crate::parallel::{RunResult, run_all};
use estimate::{Runs, exact};

/// Refinements, and those where the values do not converge.
const REFINEMENTS: u32 = 2;
const MORE_REFINEMENTS: u32 = 3;

/// Runs of the ensemble, and the greatest change of a coordinate of their starts \[m, rad\]: about
/// the error of a step.
const MEMBERS: usize = 8;
const MAGNITUDE: Magnitude = Magnitude::UpTo(1e-6);

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
    match bars(assembly, row::of_report(report.clone()), progress) {
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
    first: SweepRow,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<ErrorBar>, Failure> {
    let expectations = &assembly.scenario().expectations;
    let refined = (1..=REFINEMENTS).map(|times| assembly.refined(times));
    let refined: Option<Vec<Refined<'_>>> = refined.collect::<Result<_, _>>()?;
    let Some(refined) = refined else {
        let kinds = expectations.iter().map(Expectation::value_kind);
        return Ok(kinds.map(exact).collect());
    };
    let file = &assembly.scenario().file;
    let run = |index: usize| row_at(file, refined.get(index));
    let mut finer = vec![first];
    finer.extend(runs(file, refined.len(), &run, progress)?);
    let ratio = refined.iter().map(|it| it.ratio).fold(0.0, f64::max);
    let of_each = |finer: &[SweepRow], perturbed: &[SweepRow]| -> Vec<Runs> {
        let expectations = expectations.iter().enumerate();
        let runs = expectations.map(|(index, of)| Runs {
            kind: of.value_kind(),
            beyond: is_beyond_horizon(assembly, of),
            finer: column(finer, index),
            perturbed: column(perturbed, index),
            ratio,
        });
        runs.collect()
    };
    let mut perturbed = Vec::new();
    if of_each(&finer, &[]).iter().any(Runs::are_open) {
        let rows = more(assembly, progress)?;
        finer.extend(rows.finest);
        perturbed = rows.perturbed;
    }
    let runs = of_each(&finer, &perturbed);
    Ok(runs.iter().map(Runs::bar).collect())
}

/// Returns an expectation of runs.
fn column(rows: &[SweepRow], index: usize) -> Vec<Option<RowExpectation>> {
    let rows = rows.iter();
    rows.map(|row| row.expectations.get(index).cloned())
        .collect()
}

/// Whether an expectation is judged past the horizon of predictability that its scenario names.
fn is_beyond_horizon(assembly: &Assembly<'_>, of: &Expectation) -> bool {
    let scenario = assembly.scenario();
    let until = of.before.unwrap_or(scenario.end());
    let horizon = scenario.horizon.map(|horizon| SimTime::ZERO + horizon);
    horizon.is_some_and(|horizon| until > horizon)
}

/// Runs a finer scene.
fn row_at(file: &str, scene: Option<&Refined<'_>>) -> RunResult<SweepRow> {
    let row = scene.map(|scene| guarded(file, || row_of(&scene.assembly, None)));
    row.map_or_else(|| Err("no such run".to_owned()), ran)
}

/// Runs for values that do not converge.
struct More {
    /// At the finest settings.
    finest: Option<SweepRow>,
    /// From perturbed starts; none of a plant that cannot be perturbed.
    perturbed: Vec<SweepRow>,
}

fn more(assembly: &Assembly<'_>, progress: &mut dyn FnMut(usize, usize)) -> Result<More, Failure> {
    let finest = assembly.refined(MORE_REFINEMENTS)?;
    let mut ensemble = Ensemble::new(assembly, MEMBERS + 1, Varied::Start)?;
    ensemble.perturb_by(MAGNITUDE);
    let members = match ensemble.why_seeds() {
        None => MEMBERS,
        Some(_) => 0,
    };
    let file = &assembly.scenario().file;
    // The finest run takes as long as several others.
    let run = |index: usize| match index {
        0 => row_at(file, finest.as_ref()),
        member => ran(ensemble.run(member, None)),
    };
    let mut rows = runs(file, 1 + members, &run, progress)?.into_iter();
    Ok(More {
        finest: rows.next(),
        perturbed: rows.collect(),
    })
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

#[cfg(test)]
mod tests;
