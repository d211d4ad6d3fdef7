//! Comparison of the runs of a study of load feedback.

use super::results::{FeedbackResult, FeedbackStudy};
use super::{FeedbackInput, FeedbackPlan, FeedbackRun};
use crate::error::StudyError;
use crate::modulation::ModulationStudy;
use crate::parallel::Ran;

/// Compares runs on loads of several sources with those on the true load. `modulation` has the
/// displacement of footsteps in all cases, or the reason why no case is suitable.
pub fn feedback(
    input: &FeedbackInput,
    plan: &FeedbackPlan,
    variable: &str,
    runs: &[Ran<FeedbackRun>],
    modulation: &Ran<ModulationStudy>,
) -> FeedbackStudy {
    let cases = input.cases.iter().enumerate().map(|(index, case)| {
        let modulated = modulation.as_ref().map(|study| &study.cases[index]);
        let modulated = modulated.map_err(String::as_str);
        FeedbackResult::new(case, &runs[index], &runs[case.reference], modulated, plan)
    });
    FeedbackStudy {
        cases: cases.collect(),
        input: input.clone(),
        plan: plan.clone(),
        variable: variable.to_owned(),
    }
}

/// Checks that a run of a study succeeded.
///
/// # Errors
/// [`StudyError`] with the reason of the first one if all failed.
pub(crate) fn check(runs: &[Ran<FeedbackRun>]) -> Result<(), StudyError> {
    match runs.first() {
        Some(Err(why)) if runs.iter().all(Result::is_err) => Err(StudyError::Run(why.clone())),
        _ => Ok(()),
    }
}
