//! Study of footstep modulation: displacement of the footsteps after a change of a variable of the
//! controller, against the run without the change (thesis, section 3.2.5.1, figures 3.5 and 3.8).

mod cycles;
mod fit;
mod results;
mod table;

pub use fit::{LinearModel, ModelForm};
pub use results::{CaseResult, IdealSlope, ModulationStudy};
pub use table::{Counting, Displacement, DisplacementCell, DisplacementTable};

use twinrig_kernel::{SimDuration, SimTime, Unit};

use crate::error::StudyError;
use crate::gait_run::GaitRun;
use crate::parallel::{Ran, run_all};
use crate::progress::ProgressObserver;
use cycles::{Reference, Shift};

/// A gait on a plant, with or without a factor.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationCase {
    /// Name of the gait: that of its scenario file.
    pub gait: String,
    /// Plant.
    pub plant: String,
    /// Factor that differs from the scenario: `as given`, `unsaturated servos`.
    pub factor: String,
    /// Time from which the reference run is in its limit cycle.
    pub after: SimTime,
    /// Value of the variable there.
    pub value: f64,
    /// Mean duty factor that the controller commands, where it does.
    pub duty: Option<f64>,
}

/// Subject of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationInput {
    /// Name of the scenario, or of the comparison of several.
    pub name: String,
    /// Paths of the scenario files.
    pub files: Vec<String>,
    /// Name of the changed variable.
    pub variable: String,
    /// Its unit.
    pub unit: Unit,
    /// Cases.
    pub cases: Vec<ModulationCase>,
    /// Parts that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// Change of the variable in a re-run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VariableChange {
    /// Time.
    pub at: SimTime,
    /// Difference from the value before, in its unit.
    pub by: f64,
}

/// Runs the cases of a study of modulation, each on the calling thread.
pub trait ModulationRunner: Sync {
    /// Returns the subject of the study.
    fn input(&self) -> &ModulationInput;

    /// Runs a case up to `end`, with the change or without one.
    ///
    /// # Errors
    /// The reason of a run that cannot be built, or fails.
    fn run(
        &self,
        case: usize,
        change: Option<VariableChange>,
        end: SimTime,
    ) -> Result<GaitRun, String>;
}

/// Parameters of a study of modulation.
#[derive(Clone, Debug, PartialEq)]
pub struct ModulationPlan {
    /// Changes of the variable, in its unit.
    pub changes: Vec<f64>,
    /// Number of points of the gait cycle at which the variable changes.
    pub points: usize,
    /// Number of footsteps of each leg after the change.
    pub steps: usize,
}

impl Default for ModulationPlan {
    /// The changes of the thesis \[m\], at ten points of the cycle.
    fn default() -> Self {
        let changes = [2.5, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0];
        Self {
            changes: changes.map(|change| -1e-3 * change).into(),
            points: 10,
            steps: 10,
        }
    }
}

/// Duration of a reference run after the limit cycle is reached: ten footsteps of a slow walk.
const REFERENCE: SimDuration = SimDuration::from_secs(20);
/// Periods of a re-run beyond its last footstep, for that footstep to end.
const MARGIN: f64 = 1.5;

/// Measures the displacement of footsteps after changes of a variable.
///
/// The result is a function of the runs; their order and the number of threads have no effect.
///
/// # Errors
/// [`StudyError`] if the reference run of every case is unsuitable, or `progress` stopped the
/// study.
pub fn modulation(
    runner: &dyn ModulationRunner,
    plan: &ModulationPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<ModulationStudy, StudyError> {
    let input = runner.input();
    let cases = &input.cases;
    let reruns = cases.len() * plan.points * plan.changes.len();
    let parts = cases.len() + reruns;
    let mut report = |before: usize, done: usize, left_s: f64| {
        progress.at(before + done, parts, &format!("{left_s:.0} s left"))
    };
    let reference = |index: usize| {
        let after = cases[index].after;
        runner.run(index, None, after + REFERENCE)
    };
    let runs = run_all(cases.len(), &reference, &mut |done, left| {
        report(0, done, left)
    })?;
    let references: Vec<Ran<Prepared>> = cases
        .iter()
        .zip(runs)
        .map(|(case, run)| Prepared::new(case, run?, plan))
        .collect();
    if let Some(first) = references.first()
        && references.iter().all(Result::is_err)
    {
        let why = first.as_ref().err().cloned().unwrap_or_default();
        return Err(StudyError::Run(why));
    }
    let rerun = |index: usize| {
        let rerun = Rerun::of(index, plan);
        let prepared = references[rerun.case].as_ref().map_err(Clone::clone)?;
        let change = VariableChange {
            at: prepared.points[rerun.point],
            by: plan.changes[rerun.change],
        };
        runner.run(rerun.case, Some(change), prepared.end)
    };
    let runs: Vec<Ran<GaitRun>> = run_all(reruns, &rerun, &mut |done, left| {
        report(cases.len(), done, left)
    })?;
    let per_case = plan.points * plan.changes.len();
    let is_length = input.unit == Unit::Meter;
    let results = references.iter().enumerate().map(|(index, prepared)| {
        let runs = &runs[index * per_case..(index + 1) * per_case];
        CaseResult::new(&cases[index], prepared, runs, plan, is_length)
    });
    Ok(ModulationStudy {
        cases: results.collect(),
        input: input.clone(),
        plan: plan.clone(),
    })
}

/// Place of a re-run among all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rerun {
    case: usize,
    change: usize,
    point: usize,
}

impl Rerun {
    fn of(index: usize, plan: &ModulationPlan) -> Self {
        let per_case = plan.points * plan.changes.len();
        let (case, rest) = (index / per_case, index % per_case);
        Self {
            case,
            change: rest / plan.points,
            point: rest % plan.points,
        }
    }
}

/// Reference run of a case, and its re-runs as they follow from it.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    reference: Reference,
    points: Vec<SimTime>,
    end: SimTime,
}

impl Prepared {
    fn new(case: &ModulationCase, run: GaitRun, plan: &ModulationPlan) -> Ran<Self> {
        if let Some(at_s) = run.fell_at_s {
            let end_s = (case.after + REFERENCE).as_secs_f64();
            return Err(StudyError::ReferenceFell { at_s, end_s }.to_string());
        }
        let after_s = case.after.as_secs_f64();
        // One for the cycle of the points, one for the heading of the last footstep.
        let reference = Reference::new(run, after_s, plan.steps + 2);
        let reference = reference.map_err(|error| error.to_string())?;
        let points_s = reference.points_s(after_s, plan.points);
        let longest_s = reference.periods_s.iter().copied().fold(0.0, f64::max);
        let last_s = points_s.last().copied().unwrap_or(after_s);
        let end_s = last_s + (plan.steps as f64 + MARGIN) * longest_s;
        Ok(Self {
            points: points_s.into_iter().map(instant).collect(),
            end: instant(end_s),
            reference,
        })
    }

    /// Returns the displacements of a re-run.
    fn displacements(
        &self,
        run: &GaitRun,
        rerun: Rerun,
        plan: &ModulationPlan,
    ) -> Vec<Displacement> {
        let at_s = self.points[rerun.point].as_secs_f64();
        Counting::ALL
            .into_iter()
            .flat_map(|counting| {
                let shifts = match counting {
                    Counting::Cycle => self.reference.by_cycle(run, at_s, plan.steps),
                    Counting::TouchDown => self.reference.by_touch_down(run, at_s, plan.steps),
                };
                shifts.into_iter().map(move |shift| (counting, shift))
            })
            .map(|(counting, Shift { leg, step, along_m })| Displacement {
                counting,
                by: plan.changes[rerun.change],
                point: rerun.point,
                leg,
                step,
                along_m,
            })
            .collect()
    }
}

fn instant(seconds: f64) -> SimTime {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a time within a run; a cast saturates"
    )]
    let nanos = (1e9 * seconds) as u64;
    SimTime::from_nanos(nanos)
}
