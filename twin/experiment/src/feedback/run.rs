//! Runs of a study of load feedback, and their comparison.

use super::results::{FeedbackResult, FeedbackStudy};
use super::{FeedbackPlan, FeedbackRun, FeedbackRunner};
use crate::error::StudyError;
use crate::modulation::{ModulationStudy, modulation};
use crate::parallel::{Ran, run_all};
use crate::progress::ProgressObserver;

/// Compares runs on loads of several sources with those on the true load.
///
/// # Errors
/// [`StudyError`] if every run fails, or `progress` stopped the study.
pub fn feedback(
    runner: &dyn FeedbackRunner,
    plan: &FeedbackPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<FeedbackStudy, StudyError> {
    let input = runner.input();
    let count = input.cases.len();
    let run = |index: usize| runner.run(index);
    let runs: Vec<Ran<FeedbackRun>> = run_all(count, &run, &mut |done, left_s| {
        progress.at(done, count, &format!("{left_s:.0} s left"))
    })?;
    if let Some(Err(why)) = runs.first()
        && runs.iter().all(Result::is_err)
    {
        return Err(StudyError::Run(why.clone()));
    }
    let modulation = displaced(runner, plan, progress)?;
    let cases = input.cases.iter().enumerate().map(|(index, case)| {
        let modulated = modulation.as_ref().map(|study| &study.cases[index]);
        let modulated = modulated.map_err(String::as_str);
        FeedbackResult::new(case, &runs[index], &runs[case.reference], modulated, plan)
    });
    Ok(FeedbackStudy {
        cases: cases.collect(),
        input: input.clone(),
        plan: plan.clone(),
        variable: runner.modulation().input().variable.clone(),
    })
}

/// Displaces footsteps in all cases; the reason if no case is suitable.
fn displaced(
    runner: &dyn FeedbackRunner,
    plan: &FeedbackPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<Ran<ModulationStudy>, StudyError> {
    match modulation(runner.modulation(), &plan.modulation, progress) {
        Ok(study) => Ok(Ok(study)),
        // Without its remedy, which is that of a study of one case.
        Err(StudyError::Run(why)) => Ok(Err(why.lines().next().unwrap_or_default().to_owned())),
        Err(error) => Err(error),
    }
}
