//! Runs of a study of gait transitions.

use super::results::{TransitionResult, TransitionStudy};
use super::{TransitionPlan, TransitionRunner};
use crate::error::StudyError;
use crate::gait::run::GaitRun;
use crate::parallel::{Ran, run_all};
use crate::progress::ProgressObserver;

/// Classifies the gait over time in every case, and dates its transitions.
///
/// # Errors
/// [`StudyError`] if every run fails, or `progress` stopped the study.
pub fn transition(
    runner: &dyn TransitionRunner,
    plan: &TransitionPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<TransitionStudy, StudyError> {
    let input = runner.input();
    let count = input.cases.len();
    let run = |index: usize| runner.run(index);
    let runs: Vec<Ran<GaitRun>> = run_all(count, &run, &mut |done, left_s| {
        progress.at(done, count, &format!("{left_s:.0} s left"))
    })?;
    if let Some(Err(why)) = runs.first()
        && runs.iter().all(Result::is_err)
    {
        return Err(StudyError::Run(why.clone()));
    }
    let cases = input.cases.iter().zip(runs);
    let results = cases.map(|(case, run)| TransitionResult::new(case, run, input, plan));
    Ok(TransitionStudy {
        cases: results.collect(),
        input: input.clone(),
        plan: *plan,
    })
}
