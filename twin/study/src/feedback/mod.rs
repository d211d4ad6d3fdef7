//! Study of load feedback: a controller on the true load of its legs, and on loads that are
//! measured, estimated or filtered.

mod load_match;
mod results;
mod step_slope;

pub use load_match::LegLoad;
pub use results::{FeedbackResult, FeedbackStudy};
pub use step_slope::StepSlope;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

use crate::error::StudyError;
use crate::gait_run::GaitRun;
use crate::modulation::{ModulationPlan, ModulationRunner, ModulationStudy, modulation};
use crate::parallel::{Ran, run_all};
use crate::progress::ProgressObserver;

/// A gait on a plant and on loads of one source.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackCase {
    /// Plant.
    pub plant: String,
    /// Name of the source: that of its scenario file, and the lag if that is varied.
    pub source: String,
    /// Name of the signal, with `*` for the leg.
    pub signal: String,
    /// Time constant of the controller's filter of the load \[s\].
    pub lag_s: f64,
    /// Index of the case with which it is compared: its own for the reference.
    pub reference: usize,
    /// Names of the fore legs.
    pub fore: Vec<String>,
    /// End of the run.
    pub end: SimTime,
}

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackInput {
    /// Name of the comparison.
    pub name: String,
    /// Paths of the scenario files.
    pub files: Vec<String>,
    /// Cases.
    pub cases: Vec<FeedbackCase>,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// Values at a step of the controller.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ControlStep {
    /// Time \[s\].
    pub at_s: f64,
    /// Load of each leg that the rule takes, after the controller's filter \[N\].
    pub loads_n: Vec<f64>,
    /// Phase of each leg \[rad\].
    pub phases_rad: Vec<f64>,
    /// Commands of the drives.
    pub commands: Vec<f64>,
}

/// Run of a controller with feedback, from the side of the controller and of the plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeedbackRun {
    /// Footsteps and trunk.
    pub gait: GaitRun,
    /// Steps of the controller.
    pub control: Vec<ControlStep>,
    /// Times at which the plant was observed \[s\], ascending.
    pub observed_s: Vec<f64>,
    /// Load of each leg at these times \[N\].
    pub loads_n: Vec<Vec<f64>>,
}

/// Runs the cases of a study of load feedback, each on the calling thread.
pub trait FeedbackRunner: Sync {
    /// Returns the subject of the study.
    fn input(&self) -> &FeedbackInput;

    /// Returns the runner of changes of a variable, with the same cases.
    fn modulation(&self) -> &dyn ModulationRunner;

    /// Runs a case.
    ///
    /// # Errors
    /// The reason of a run that cannot be built, or fails.
    fn run(&self, case: usize) -> Result<FeedbackRun, String>;
}

/// Parameters of a study of load feedback.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackPlan {
    /// Time from which speed, footsteps and loads count \[s\].
    pub after_s: f64,
    /// Time from the first step of the controller over which phases are compared \[s\].
    pub phases_s: f64,
    /// Changes of a variable, and the footsteps after them.
    pub modulation: ModulationPlan,
}

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
