//! Runs of a study of footstep modulation.

use twinrig_kernel::Unit;

use super::rerun::{Prepared, REFERENCE, Rerun};
use super::results::{CaseResult, ModulationStudy};
use super::{ModulationPlan, ModulationRunner, VariableChange};
use crate::error::StudyError;
use crate::gait::run::GaitRun;
use crate::parallel::{Ran, run_all};
use crate::progress::ProgressObserver;

/// Measures the displacement of footsteps after changes of a variable.
///
/// The result is a function of the runs; their order and the number of threads have no effect.
///
/// # Errors
/// [`StudyError`] if the reference run of every case is unsuitable, or `progress` stopped the
/// study.
pub fn modulation(
    runner: &dyn ModulationRunner,
    plan: &ModulationPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<ModulationStudy, StudyError> {
    let input = runner.input();
    let cases = &input.cases;
    let reruns = cases.len() * plan.points * plan.changes.len();
    let parts = cases.len() + reruns;
    let mut report = |before: usize, done: usize, left_s: f64| {
        progress.at(before + done, parts, &format!("{left_s:.0} s left"))
    };
    let reference = |index: usize| {
        let after = cases[index].after;
        runner.run(index, None, after + REFERENCE)
    };
    let runs = run_all(cases.len(), &reference, &mut |done, left| {
        report(0, done, left)
    })?;
    let references: Vec<Ran<Prepared>> = cases
        .iter()
        .zip(runs)
        .map(|(case, run)| Prepared::new(case, run?, plan))
        .collect();
    if let Some(first) = references.first()
        && references.iter().all(Result::is_err)
    {
        let why = first.as_ref().err().cloned().unwrap_or_default();
        return Err(StudyError::Run(why));
    }
    let rerun = |index: usize| {
        let rerun = Rerun::of(index, plan);
        let prepared = references[rerun.case].as_ref().map_err(Clone::clone)?;
        let change = VariableChange {
            at: prepared.points[rerun.point],
            by: plan.changes[rerun.change],
        };
        runner.run(rerun.case, Some(change), prepared.end)
    };
    let runs: Vec<Ran<GaitRun>> = run_all(reruns, &rerun, &mut |done, left| {
        report(cases.len(), done, left)
    })?;
    let per_case = plan.points * plan.changes.len();
    let is_length = input.unit == Unit::Meter;
    let results = references.iter().enumerate().map(|(index, prepared)| {
        let runs = &runs[index * per_case..(index + 1) * per_case];
        CaseResult::new(&cases[index], prepared, runs, plan, is_length)
    });
    Ok(ModulationStudy {
        cases: results.collect(),
        input: input.clone(),
        plan: plan.clone(),
    })
}
