//! Runs of a study of robustness.

use super::results::{RobustnessResult, RobustnessStudy};
use super::{RobustnessPlan, RobustnessRunner};
use crate::error::StudyError;
use crate::parallel::run_all_on;
use crate::progress::ProgressObserver;

/// Runs the ensembles. A member that cannot be built, or panics, is a run with an error.
///
/// # Errors
/// [`StudyError`] if the unperturbed run of every case fails, or `progress` stopped the study.
pub fn robustness(
    runner: &dyn RobustnessRunner,
    plan: &RobustnessPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<RobustnessStudy, StudyError> {
    let cases = runner.cases();
    let count = cases.len() * plan.runs;
    let mut left_out = runner.left_out().to_vec();
    let mut results = Vec::new();
    let mut first_error = None;
    for (index, case) in cases.iter().enumerate() {
        let before = index * plan.runs;
        let run = |member: usize| runner.run(index, member);
        let runs = run_all_on(plan.jobs, plan.runs, &run, &mut |done, _| {
            progress.at(before + done, count, &case.scenario)
        })?;
        let of = |error: &str| format!("{} on {}: {error}", case.scenario, case.plant);
        match RobustnessResult::new(case, runs, plan) {
            Ok(result) => results.push(result),
            Err(why) => {
                left_out.push(of(&why));
                first_error.get_or_insert(why);
            }
        }
    }
    if let (true, Some(why)) = (results.is_empty(), first_error) {
        return Err(StudyError::Run(why));
    }
    Ok(RobustnessStudy {
        plan: *plan,
        results,
        left_out,
    })
}
