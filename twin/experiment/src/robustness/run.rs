//! Ensembles of a study of robustness, from their runs.

use super::results::{RobustnessResult, RobustnessStudy};
use super::{MemberRun, RobustnessCase, RobustnessPlan};
use crate::error::StudyError;
use crate::parallel::RunResult;

/// A study to which one ensemble after another is added, so that the trajectories of one ensemble
/// are in memory at a time.
pub(crate) struct Robustness {
    plan: RobustnessPlan,
    left_out: Vec<String>,
    results: Vec<RobustnessResult>,
    first_error: Option<String>,
}

impl Robustness {
    /// Begins with the parts that are left out.
    pub(crate) fn new(plan: &RobustnessPlan, left_out: &[String]) -> Self {
        Self {
            plan: *plan,
            left_out: left_out.to_vec(),
            results: Vec::new(),
            first_error: None,
        }
    }

    /// Adds the ensemble of a case. A member that cannot be built, or panics, is a run with an
    /// error.
    pub(crate) fn add(&mut self, case: &RobustnessCase, runs: Vec<RunResult<MemberRun>>) {
        match RobustnessResult::new(case, runs, &self.plan) {
            Ok(result) => self.results.push(result),
            Err(why) => {
                let of = format!("{} on {}: {why}", case.scenario, case.plant);
                self.left_out.push(of);
                self.first_error.get_or_insert(why);
            }
        }
    }

    /// Ends the study.
    ///
    /// # Errors
    /// [`StudyError`] if the unperturbed run of every case failed.
    pub(crate) fn finish(self) -> Result<RobustnessStudy, StudyError> {
        if let (true, Some(why)) = (self.results.is_empty(), self.first_error) {
            return Err(StudyError::Run(why));
        }
        Ok(RobustnessStudy {
            plan: self.plan,
            results: self.results,
            left_out: self.left_out,
        })
    }
}

#[cfg(test)]
mod tests {
    use twinrig_campaign::spread::EnsembleKind;

    use super::*;

    #[test]
    fn study_without_a_result_has_the_reason_of_its_first_case() {
        let plan = RobustnessPlan {
            runs: 2,
            tolerance: 1e-3,
        };
        let case = RobustnessCase {
            scenario: "trot".to_owned(),
            file: "trot.toml".to_owned(),
            plant: "lcp".to_owned(),
            kind: EnsembleKind::Starts,
            why_seeds: None,
            unit: None,
            duration_s: 1.0,
        };
        let mut study = Robustness::new(&plan, &[]);
        for why in ["it snapped", "it fell"] {
            study.add(&case, vec![Err(why.to_owned())]);
        }
        assert_eq!(study.left_out[1], "trot on lcp: it fell");
        let error = study.finish().unwrap_err();
        assert_eq!(error, StudyError::Run("it snapped".to_owned()));
    }
}
