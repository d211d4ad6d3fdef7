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

use crate::budget::{Budget, Share, Weight};
use crate::error::StudyError;
use crate::incidents::Incidents;
use crate::measured::{Measuring, Parts};
use crate::plants::reference_note::{CheckNote, ReferenceNote};
use crate::plants::row::Status;
use results::NEAR_M;
use run::Run;

/// Default duration.
const WINDOW: SimDuration = SimDuration::from_secs(1);

/// Measures error and run time of coupling on a grid.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or if the observer stopped the study.
pub fn coupling<'m>(
    factory: &dyn RigFactory,
    plan: &CouplingPlan,
    measuring: impl Into<Measuring<'m>>,
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
    let incidents = Incidents::default();
    let runs = Runs {
        factory,
        incidents: &incidents,
        plan,
        observe,
        duration,
    };
    let weights = [
        (Weight::Run, plants.len() * trials.len()),
        (Weight::Reference, plants.len() * 2),
    ];
    let budget = Budget::new(plan.budget_s, &weights);
    let scope = (duration, observe, plan.repetitions);
    let mut measuring = measuring.into();
    let mut job = Job {
        runs,
        parts: Parts::new(budget, &mut measuring, &incidents, &scope),
    };
    let mut study = CouplingStudy::new(input, plan, duration, observe);
    for plant in plants {
        let (reference, note) = job.reference(plant)?;
        study.references.push(note.clone());
        let reference = reference.as_ref().map(|run| (run, study.floor_of(plant)));
        for trial in &trials {
            let label = format!(
                "{plant}, {} {}",
                trial.method.word(),
                si(trial.step.as_secs_f64(), "s")
            );
            let content = (plant, trial, &note);
            let row = job.parts.measure(&label, Weight::Run, &content, |share| {
                runs.row(plant, trial, reference, share)
            })?;
            study.rows.push(row);
        }
    }
    study.starts = job.parts.finish()?;
    study.left_out.extend_from_slice(factory.left_out());
    study.panics = incidents.into_panics();
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
    runs: Runs<'a>,
    parts: Parts<'a>,
}

/// Runs of a study: their environment and plan.
#[derive(Clone, Copy)]
struct Runs<'a> {
    factory: &'a dyn RigFactory,
    incidents: &'a Incidents,
    plan: &'a CouplingPlan,
    observe: SimDuration,
    duration: SimDuration,
}

impl Job<'_> {
    /// Runs a rig with exact coupling; the inner error is the reason of an incomplete run.
    fn completed(
        &mut self,
        plant: &str,
        step: SimDuration,
        doing: &str,
    ) -> Result<Result<Run, String>, StudyError> {
        let runs = self.runs;
        let (label, content) = (format!("{plant}, {doing}"), ("exact", plant, step));
        let measured = self
            .parts
            .measure(&label, Weight::Reference, &content, |share| {
                let variant = runs.variant(plant, Coupling::Exact, step);
                runs.incidents
                    .guarded(|| Run::of(runs.factory, &variant, share))
            });
        Ok(measured?.and_then(|run| match &run.ended {
            Some((_, why)) => Err(why.clone()),
            None => Ok(run),
        }))
    }

    /// Returns the reference of a plant, truncated where its check ceases to agree.
    fn reference(&mut self, plant: &str) -> Result<(Option<Run>, ReferenceNote), StudyError> {
        let fine = self.runs.plan.fine;
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
}

impl Runs<'_> {
    fn variant<'p>(&self, plant: &'p str, coupling: Coupling, step: SimDuration) -> RigVariant<'p> {
        RigVariant {
            plant,
            coupling,
            step,
            observe: self.observe,
            duration: self.duration,
        }
    }

    fn row(
        &self,
        plant: &str,
        trial: &Trial,
        reference: Option<(&Run, f64)>,
        share: Share,
    ) -> CouplingRow {
        let variant = self.variant(plant, trial.method.choice(trial.step), trial.plant_step);
        let mut row = CouplingRow::new(
            trial.kind,
            plant,
            trial.method,
            trial.step.as_secs_f64(),
            trial.plant_step.as_secs_f64(),
        );
        let run = self
            .incidents
            .guarded(|| Run::of(self.factory, &variant, share));
        let run = match run {
            Ok(run) => run,
            Err(why) => return row.ended(Status::Failed, why),
        };
        let reached_s = run.trace.reached_s();
        row.note_work(&run.work, reached_s - run.opened_s);
        if let Some((status, why)) = &run.ended {
            row.note_time(run.wall_s, reached_s, 1);
            row.cut = run.cut;
            return row.ended(*status, why.as_str());
        }
        match reference {
            Some((reference, floor_m)) => compare(&mut row, &run, reference, floor_m),
            None => row.why = Some("there is no reference to compare with".to_owned()),
        }
        self.time(&mut row, &variant, &run, share);
        row
    }

    /// Measures the run time of a rig that completes: the median of several runs without sampling,
    /// of fewer if they are slow.
    fn time(&self, row: &mut CouplingRow, variant: &RigVariant<'_>, run: &Run, share: Share) {
        let (mut times, mut used_s) = (Vec::new(), run.wall_s);
        for _ in 0..self.plan.repetitions.max(1) {
            if used_s + run.wall_s > share.seconds {
                break;
            }
            let timed = self
                .incidents
                .guarded(|| Ok(Run::time(self.factory, variant)));
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
