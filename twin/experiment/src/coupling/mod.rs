//! Study of coupling: error against run time for exact and grid coupling of plant and boards.

mod builder;
mod factory;
mod options;
mod outliers;
mod plan;
mod results;
mod row;
mod run;
mod view;

pub use factory::{CouplingInput, CouplingMethod, RigFactory, RigVariant};
pub use options::CouplingOptions;
pub use plan::CouplingPlan;
pub use results::{CouplingOrder, CouplingStudy};
pub use row::{CouplingKind, CouplingRow};

use twinrig_kernel::SimDuration;
use twinrig_report::number::si;
use twinrig_rig::PlantId;
use twinrig_runtime::Coupling;

use crate::budget::{Budget, Share};
use crate::error::StudyError;
use crate::panics::Panics;
use crate::plants::reference_note::{CheckNote, ReferenceNote};
use crate::plants::row::Status;
use crate::progress::ProgressObserver;
use results::NEAR_M;
use run::Run;

/// Default duration.
const WINDOW: SimDuration = SimDuration::from_secs(1);

/// Measures error and run time of coupling on a grid.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or if `progress` stopped the study.
pub fn coupling(
    factory: &dyn RigFactory,
    plan: &CouplingPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<CouplingStudy, StudyError> {
    let plants = factory.plants();
    let (Some(observe), false) = (plan.steps.first().copied(), plants.is_empty()) else {
        return Err(StudyError::NoPlant);
    };
    let input = factory.input();
    let duration = plan.duration.unwrap_or(WINDOW).min(input.duration);
    if duration < observe || observe.is_zero() {
        return Err(StudyError::TooShort {
            duration,
            least: observe,
        });
    }
    let duration = observe * (duration.as_nanos() / observe.as_nanos());
    let trials = trials(plan);
    let panics = Panics::default();
    let mut job = Job {
        factory,
        panics: &panics,
        plan,
        observe,
        duration,
        budget: Budget::new(
            plan.budget_s,
            plants.len() * (2 + trials.len()),
            plants.len() * 2,
        ),
        progress,
    };
    let mut study = CouplingStudy::new(input, plan, duration, observe);
    for plant in plants {
        let (reference, note) = job.reference(plant)?;
        study.references.push(note);
        let reference = reference.as_ref().map(|run| (run, study.floor_of(plant)));
        for trial in &trials {
            let row = job.row(plant, trial, reference)?;
            study.rows.push(row);
        }
    }
    job.budget.finished()?;
    study.left_out.extend_from_slice(factory.left_out());
    study.panics = panics.into_messages();
    study.mark_contradictions();
    Ok(study)
}

/// Combination of coupling and steps, run with every plant.
#[derive(Clone, Copy, Debug)]
struct Trial {
    kind: CouplingKind,
    method: CouplingMethod,
    step: SimDuration,
    plant_step: SimDuration,
}

fn trials(plan: &CouplingPlan) -> Vec<Trial> {
    let mut trials = Vec::new();
    for kind in [CouplingKind::Together, CouplingKind::Alone] {
        for method in CouplingMethod::ALL {
            // Exact coupling alone has no error.
            let skipped = kind == CouplingKind::Alone && method == CouplingMethod::Exact;
            let steps = plan.steps.iter().filter(|_| !skipped);
            trials.extend(steps.map(|&step| Trial {
                kind,
                method,
                step,
                plant_step: match kind {
                    CouplingKind::Together => step,
                    CouplingKind::Alone => plan.fine.min(step),
                },
            }));
        }
    }
    trials
}

/// State of a running study.
struct Job<'a> {
    factory: &'a dyn RigFactory,
    panics: &'a Panics,
    plan: &'a CouplingPlan,
    observe: SimDuration,
    duration: SimDuration,
    budget: Budget,
    progress: &'a mut dyn ProgressObserver,
}

impl Job<'_> {
    fn begin(&mut self, doing: &str, reference: bool) -> Result<Share, StudyError> {
        let share = self.budget.next(reference);
        let (part, of) = self.budget.progress();
        if self.progress.at(part, of, doing) {
            Ok(share)
        } else {
            Err(StudyError::Interrupted { done: part, of })
        }
    }

    fn variant<'p>(&self, plant: &'p str, coupling: Coupling, step: SimDuration) -> RigVariant<'p> {
        RigVariant {
            plant,
            coupling,
            step,
            observe: self.observe,
            duration: self.duration,
        }
    }

    /// Runs a rig with exact coupling; the inner error is the reason of an incomplete run.
    fn completed(
        &mut self,
        plant: &str,
        step: SimDuration,
        doing: &str,
    ) -> Result<Result<Run, String>, StudyError> {
        let share = self.begin(&format!("{plant}, {doing}"), true)?;
        let variant = self.variant(plant, Coupling::Exact, step);
        let run = self
            .panics
            .guarded(|| Run::of(self.factory, &variant, share));
        Ok(run.and_then(|run| match &run.ended {
            Some((_, why)) => Err(why.clone()),
            None => Ok(run),
        }))
    }

    /// Returns the reference of a plant, truncated where its check ceases to agree.
    fn reference(&mut self, plant: &str) -> Result<(Option<Run>, ReferenceNote), StudyError> {
        let fine = self.plan.fine;
        let reference = self.completed(plant, fine, "reference")?;
        let check = self.completed(plant, fine * 2, "check of the reference")?;
        let mut reference = match reference {
            Ok(reference) => reference,
            Err(why) => return Ok((None, ReferenceNote::missing(&PlantId::new(plant), why))),
        };
        let mut note = ReferenceNote {
            method: Some(CouplingMethod::Exact.word().to_owned()),
            step_s: Some(fine.as_secs_f64()),
            ..ReferenceNote::missing(&PlantId::new(plant), String::new())
        };
        let mut why = vec!["it is checked by itself, at steps twice as long".to_owned()];
        match check {
            Ok(check) => {
                note.holds_until_s = reference.trace.trust_while_near(&check.trace, NEAR_M);
                let errors = check.trace.errors(&reference.trace);
                note.check = errors.map(|errors| CheckNote {
                    method: CouplingMethod::Exact.word().to_owned(),
                    step_s: Some((fine * 2).as_secs_f64()),
                    tolerance: None,
                    independent: false,
                    disagreement_rms_m: errors.foot_rms,
                    disagreement_max_m: errors.foot_max,
                });
            }
            Err(failed) => why = vec![format!("nothing checks it: {failed}")],
        }
        if let Some(until_s) = note.holds_until_s {
            why.push(format!(
                "it and its check agree up to {}; nothing is compared after that",
                si(until_s, "s")
            ));
        }
        note.why = Some(why.join("; "));
        Ok((Some(reference), note))
    }

    fn row(
        &mut self,
        plant: &str,
        trial: &Trial,
        reference: Option<(&Run, f64)>,
    ) -> Result<CouplingRow, StudyError> {
        let doing = format!(
            "{plant}, {} {}",
            trial.method.word(),
            si(trial.step.as_secs_f64(), "s")
        );
        let share = self.begin(&doing, false)?;
        let variant = self.variant(plant, trial.method.choice(trial.step), trial.plant_step);
        let mut row = CouplingRow::new(
            trial.kind,
            plant,
            trial.method,
            trial.step.as_secs_f64(),
            trial.plant_step.as_secs_f64(),
        );
        let run = self
            .panics
            .guarded(|| Run::of(self.factory, &variant, share));
        let run = match run {
            Ok(run) => run,
            Err(why) => return Ok(row.ended(Status::Failed, why)),
        };
        let reached_s = run.trace.reached_s();
        row.note_work(&run.work, reached_s - run.opened_s);
        if let Some((status, why)) = &run.ended {
            row.note_time(run.wall_s, reached_s, 1);
            row.cut = run.cut;
            return Ok(row.ended(*status, why.as_str()));
        }
        match reference {
            Some((reference, floor_m)) => compare(&mut row, &run, reference, floor_m),
            None => row.why = Some("there is no reference to compare with".to_owned()),
        }
        self.time(&mut row, &variant, &run, share);
        Ok(row)
    }

    /// Measures the run time of a rig that completes: the median of several runs without sampling,
    /// of fewer if they are slow.
    fn time(&self, row: &mut CouplingRow, variant: &RigVariant<'_>, run: &Run, share: Share) {
        let (mut times, mut used_s) = (Vec::new(), run.wall_s);
        for _ in 0..self.plan.repetitions.max(1) {
            if used_s + run.wall_s > share.seconds {
                break;
            }
            let timed = self.panics.guarded(|| Ok(Run::time(self.factory, variant)));
            let Ok(Some(run_s)) = timed else {
                break;
            };
            used_s += run_s;
            times.push(run_s);
        }
        if times.is_empty() {
            times.push(run.wall_s);
        }
        times.sort_by(f64::total_cmp);
        let median = times[times.len() / 2];
        row.note_time(median, variant.duration.as_secs_f64(), times.len() as u64);
    }
}

fn compare(row: &mut CouplingRow, run: &Run, reference: &Run, floor_m: f64) {
    match run.trace.errors(&reference.trace) {
        Some(errors) => {
            row.note_errors(&errors);
            row.at_floor = errors.foot_rms <= floor_m;
        }
        None => row.why = Some("it has no foot in common with the reference".to_owned()),
    }
    row.counters_changed = Some(run.changed_counters(reference));
}
