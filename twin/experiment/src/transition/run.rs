//! Gaits over time, from the runs of a study of gait transitions.

use super::results::{TransitionResult, TransitionStudy};
use super::{TransitionInput, TransitionPlan};
use crate::error::StudyError;
use crate::gait::run::GaitRun;
use crate::parallel::RunResult;

/// Classifies the gait over time in the run of each case, and dates its transitions.
///
/// # Errors
/// [`StudyError`] if every run failed.
pub fn transition(
    input: &TransitionInput,
    plan: &TransitionPlan,
    runs: Vec<RunResult<GaitRun>>,
) -> Result<TransitionStudy, StudyError> {
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
