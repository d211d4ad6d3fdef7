//! Rounds of a study of footstep modulation: reference runs, then re-runs with changes at instants
//! that follow from them.

use twinrig_kernel::{SimTime, Unit};

use super::rerun::{Prepared, REFERENCE, Rerun};
use super::results::{CaseResult, ModulationStudy};
use super::{ModulationInput, ModulationPlan, VariableChange};
use crate::error::StudyError;
use crate::gait::run::GaitRun;
use crate::parallel::RunResult;

/// A run of a case up to `end`, with the change or without one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModulationRun {
    /// Index of the case.
    pub case: usize,
    /// Change of the variable.
    pub change: Option<VariableChange>,
    /// End.
    pub end: SimTime,
}

/// A study of which the reference runs are done.
///
/// The result is a function of the runs; their order and the number of threads have no effect.
pub struct Modulation<'i> {
    input: &'i ModulationInput,
    plan: &'i ModulationPlan,
    references: Vec<RunResult<Prepared>>,
}

impl<'i> Modulation<'i> {
    /// Returns the reference runs, one of each case.
    pub fn references(input: &ModulationInput) -> Vec<ModulationRun> {
        let cases = input.cases.iter().enumerate();
        let reference = |(index, case): (usize, &super::ModulationCase)| ModulationRun {
            case: index,
            change: None,
            end: case.after + REFERENCE,
        };
        cases.map(reference).collect()
    }

    /// Returns the number of re-runs, if all reference runs are suitable.
    pub fn reruns(input: &ModulationInput, plan: &ModulationPlan) -> usize {
        input.cases.len() * plan.points * plan.changes.len()
    }

    /// Continues with the reference runs.
    ///
    /// # Errors
    /// [`StudyError`] if none of them is suitable.
    pub fn new(
        input: &'i ModulationInput,
        plan: &'i ModulationPlan,
        runs: Vec<RunResult<GaitRun>>,
    ) -> Result<Self, StudyError> {
        let cases = input.cases.iter().zip(runs);
        let references: Vec<RunResult<Prepared>> = cases
            .map(|(case, run)| Prepared::new(case, run?, plan))
            .collect();
        if let Some(Err(why)) = references.first()
            && references.iter().all(Result::is_err)
        {
            return Err(StudyError::Run(why.clone()));
        }
        Ok(Self {
            input,
            plan,
            references,
        })
    }

    /// Returns the re-runs of the cases with a suitable reference.
    pub fn changed(&self) -> Vec<ModulationRun> {
        let reruns = 0..Self::reruns(self.input, self.plan);
        let run = |index| {
            let rerun = Rerun::of(index, self.plan);
            let prepared = self.references[rerun.case].as_ref().ok()?;
            let change = VariableChange {
                at: prepared.points[rerun.point],
                by: self.plan.changes[rerun.change],
            };
            Some(ModulationRun {
                case: rerun.case,
                change: Some(change),
                end: prepared.end,
            })
        };
        reruns.filter_map(run).collect()
    }

    /// Measures the displacement of footsteps, by the re-runs.
    pub fn finish(self, runs: Vec<RunResult<GaitRun>>) -> ModulationStudy {
        let per_case = self.plan.points * self.plan.changes.len();
        let is_length = self.input.unit == Unit::Meter;
        let mut runs = runs.into_iter();
        let cases = self.input.cases.iter().zip(&self.references);
        let results = cases.map(|(case, prepared)| {
            let reruns = prepared.as_ref().map_or(0, |_| per_case);
            let runs: Vec<RunResult<GaitRun>> = runs.by_ref().take(reruns).collect();
            CaseResult::new(case, prepared, &runs, self.plan, is_length)
        });
        ModulationStudy {
            cases: results.collect(),
            input: self.input.clone(),
            plan: self.plan.clone(),
        }
    }
}
