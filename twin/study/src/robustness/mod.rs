//! Study of robustness: ensembles of runs of a scenario from perturbed starts, the margins of its
//! expectations over them, and the time up to which its trajectory is predictable.

mod divergence;
mod results;
mod view;

pub use divergence::{Divergence, Growth, Trajectory};
pub use results::{EnsembleRun, GrowthRate, RobustnessResult, RobustnessStudy};

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};
use twinrig_campaign::sweep::SweepRow;

use crate::error::StudyError;
use crate::parallel::run_all_on;
use crate::progress::ProgressObserver;
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread, Magnitude};
use twinrig_report::number::{plain, si};

/// Returns a margin of an expectation with its unit.
pub(crate) fn margin_text(expectation: &ExpectationSpread, margin: f64) -> String {
    match &*expectation.unit {
        "1" => plain(margin),
        unit => si(margin, unit),
    }
}

/// A scenario on a plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobustnessCase {
    /// Name of the scenario.
    pub scenario: String,
    /// Path of the scenario file.
    pub file: String,
    /// Plant.
    pub plant: String,
    /// Difference between the runs.
    pub kind: EnsembleKind,
    /// Reason why the start is not perturbed.
    pub why_seeds: Option<String>,
    /// Unit of the distance between trajectories: `m`, or `rad` of a plant that observes angles
    /// only; none if it observes neither.
    pub unit: Option<String>,
    /// Duration of a run \[s\].
    pub duration_s: f64,
}

/// Run of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MemberRun {
    /// Verdict and expectations.
    pub row: SweepRow,
    /// Positions over time.
    pub trajectory: Trajectory,
    /// Times from each touch-down of a leg to its next \[s\].
    pub strides_s: Vec<f64>,
}

/// Runs the members of ensembles, each on the calling thread.
pub trait RobustnessRunner: Sync {
    /// Returns the cases.
    fn cases(&self) -> &[RobustnessCase];

    /// Returns the parts that are left out, each with the reason.
    fn left_out(&self) -> &[String];

    /// Runs a member of a case: 0 is the unperturbed one.
    ///
    /// # Errors
    /// The reason of a run that cannot be built.
    fn run(&self, case: usize, member: usize) -> Result<MemberRun, String>;
}

/// Parameters of a study of robustness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobustnessPlan {
    /// Runs of each ensemble, the unperturbed one included; at least 2.
    pub runs: usize,
    /// Distance of two trajectories beyond which one does not predict the other, in m or rad.
    pub tolerance: f64,
    /// Greatest number of runs at the same time; none: one on each processor.
    pub jobs: Option<NonZeroUsize>,
}

impl RobustnessPlan {
    /// Returns the magnitudes of the perturbed runs of an ensemble, in their order.
    pub fn magnitudes(&self) -> Vec<Magnitude> {
        Magnitude::spaced(self.runs.saturating_sub(1))
    }
}

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
