//! Comparison of the runs of a study of load feedback.

use super::results::{FeedbackResult, FeedbackStudy};
use super::{FeedbackInput, FeedbackPlan, FeedbackRun};
use crate::error::StudyError;
use crate::modulation::ModulationStudy;
use crate::parallel::RunResult;

/// Compares runs on loads of several sources with those on the true load. `modulation` has the
/// displacement of footsteps in all cases, or the reason why no case is suitable.
pub fn feedback(
    input: &FeedbackInput,
    plan: &FeedbackPlan,
    variable: &str,
    runs: &[RunResult<FeedbackRun>],
    modulation: &RunResult<ModulationStudy>,
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
pub(crate) fn check(runs: &[RunResult<FeedbackRun>]) -> Result<(), StudyError> {
    match runs.first() {
        Some(Err(why)) if runs.iter().all(Result::is_err) => Err(StudyError::Run(why.clone())),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::{SimTime, Unit};

    use super::*;
    use crate::feedback::{ControlStep, FeedbackCase};
    use crate::modulation::{CaseResult, ModulationCase, ModulationInput, ModulationPlan};

    fn case(plant: &str, reference: usize) -> FeedbackCase {
        FeedbackCase {
            plant: plant.to_owned(),
            source: String::new(),
            signal: String::new(),
            lag_s: 0.0,
            reference,
            fore: Vec::new(),
            end: SimTime::ZERO,
        }
    }

    /// Returns a run with one step of the controller.
    fn run(command: f64) -> FeedbackRun {
        let step = ControlStep {
            commands: vec![command],
            ..ControlStep::default()
        };
        FeedbackRun {
            control: vec![step],
            ..FeedbackRun::default()
        }
    }

    /// Two cases on each plant, whose commands differ from plant to plant only.
    #[test]
    fn case_is_compared_with_the_reference_of_its_plant() {
        let cases = [("a", 0), ("a", 0), ("b", 2), ("b", 2)];
        let input = FeedbackInput {
            name: String::new(),
            files: Vec::new(),
            cases: cases
                .map(|(plant, reference)| case(plant, reference))
                .into(),
            left_out: Vec::new(),
        };
        let modulation = ModulationPlan::default();
        let displaced = ["one", "two", "three", "four"].map(|why| {
            let case = ModulationCase {
                gait: String::new(),
                plant: String::new(),
                factor: String::new(),
                after: SimTime::ZERO,
                value: 0.0,
                duty: None,
            };
            CaseResult::new(&case, &Err(why.to_owned()), &[], &modulation, true)
        });
        let study = ModulationStudy {
            input: ModulationInput {
                name: String::new(),
                files: Vec::new(),
                variable: String::new(),
                unit: Unit::Meter,
                cases: Vec::new(),
                left_out: Vec::new(),
            },
            plan: modulation.clone(),
            cases: displaced.into(),
        };
        let plan = FeedbackPlan {
            after_s: 0.0,
            phases_s: 1.0,
            modulation,
        };
        let runs = [1.0, 1.0, 2.0, 2.0].map(|command| Ok(run(command)));
        let found = feedback(&input, &plan, "step_length", &runs, &Ok(study)).cases;
        assert!(found.iter().all(|it| it.differs_after_s.is_none()));
        let why = found.iter().map(|it| it.undisplaced.as_deref().unwrap());
        assert!(why.eq(["one", "two", "three", "four"]));
    }

    #[test]
    fn study_fails_if_all_runs_do() {
        let failed = || Err("it fell".to_owned());
        assert!(check(&[failed(), Ok(run(1.0))]).is_ok());
        assert!(check(&[Ok(run(1.0)), failed()]).is_ok());
        let error = check(&[failed(), Err("too".to_owned())]).unwrap_err();
        assert_eq!(error, StudyError::Run("it fell".to_owned()));
    }
}
