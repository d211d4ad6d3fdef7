//! Study of precision: error against run time.

use std::rc::Rc;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_report::number::{instant, si};
use twinrig_rig::{MethodOffer, MethodSetting, PlantOffer, Scales, SettingKind, Variant};

use crate::budget::{Budget, Share, Weight};
use crate::error::StudyError;
use crate::incidents::Incidents;
use crate::measured::{Measured, Measuring, Parts};
use crate::plants::contact;
use crate::plants::differences;
use crate::plants::ensemble;
use crate::plants::events;
use crate::plants::factory::PlantFactory;
use crate::plants::models::limit_pair;
use crate::plants::plant_run::Ending;
use crate::plants::precision_job::{Job, Runs};
use crate::plants::precision_plan::PrecisionPlan;
use crate::plants::reference::{Reference, RunContext, ended};
use crate::plants::reference_note::ReferenceNote;
use crate::plants::references::{AssignedReference, References, model_of};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::{Study, StudyKind};
use crate::plants::trace::Trace;
use crate::plants::transport;

/// Default duration: that shown by the thesis for its models (figure 2.5).
const WINDOW: SimDuration = SimDuration::from_millis(300);
/// A run is unstable if its kinetic energy exceeds this multiple of the energy available in its
/// reference.
pub(crate) const RUNAWAY: f64 = 100.0;

/// Measures error and run time of the methods of all plants.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or if the observer stopped the study.
pub fn precision<'m>(
    factory: &dyn PlantFactory,
    plan: &PrecisionPlan,
    measuring: impl Into<Measuring<'m>>,
) -> Result<Study, StudyError> {
    let plants = factory.plants();
    if plants.is_empty() {
        return Err(StudyError::NoPlant);
    }
    let incidents = Incidents::default();
    let context = context(factory, plan, &incidents)?;
    let rows: usize = plants
        .iter()
        .map(|plant| settings(plant, plan, &context).count())
        .sum();
    let compared = plants.len() - 1;
    // A walk is compared by its touch-downs: the difference that vanishes with the segment masses
    // is hidden by the sensitivity of the gait to perturbations.
    let walks = context.factory.input().ground && context.factory.input().commands.change();
    let limits = match limit_pair(factory) {
        Some(_) if walks => plants.len(),
        Some(_) => plan.masses.len(),
        None => 0,
    };
    let ensembles = ensemble::parts(plants, if walks { plan.ensemble } else { 0 });
    let touching = if walks { contact::parts(plants) } else { 0 };
    let walked = if walks { transport::parts(plants) } else { 0 };
    let weights = [
        (
            Weight::Run,
            rows + touching + compared.min(1) * limits + differences::parts(plants),
        ),
        (Weight::Reference, plants.len() + walked),
        (Weight::Ensemble, ensembles),
    ];
    let budget = Budget::new(plan.budget_s, &weights);
    let scope = (context.end, context.grid, plan.repetitions);
    let mut measuring = measuring.into();
    let runs = Runs { context, plan };
    let mut job = Job {
        runs,
        parts: Parts::new(budget, &mut measuring, &incidents, &scope),
        rows: Vec::new(),
    };
    let (references, notes) = job.references(plants)?;
    let transports = if walks {
        job.transports(plants)?
    } else {
        Vec::new()
    };
    for ((plant, reference), note) in plants.iter().zip(&references).zip(&notes) {
        job.plant(plant, reference.as_deref(), note)?;
    }
    job.differences(plants, &references)?;
    let (mut footsteps, mut ensembles) = (Vec::new(), Vec::new());
    let mut contacts = Vec::new();
    if walks {
        contacts = job.contacts(plants)?;
        footsteps = job.footsteps(plants, &references)?;
        ensembles = job.ensembles(plants)?;
    } else {
        job.limit()?;
    }
    let mut study = Study::new(StudyKind::Precision, factory, context.end, context.grid);
    study.starts = job.parts.finish()?;
    study.references = notes;
    study.rows = job.rows;
    study.footsteps = footsteps;
    study.transports = transports;
    study.contacts = contacts;
    study.ensembles = ensembles;
    study.budget_s = plan.budget_s;
    study.panics = incidents.into_panics();
    study.mark_contradictions();
    study.note_tolerance_slopes();
    Ok(study)
}

/// References of all plants, with their notes.
type AllReferences = (Vec<Option<Rc<Reference>>>, Vec<ReferenceNote>);

/// Returns the environment of the runs: end time and sampling period.
fn context<'a>(
    factory: &'a dyn PlantFactory,
    plan: &PrecisionPlan,
    incidents: &'a Incidents,
) -> Result<RunContext<'a>, StudyError> {
    let input = factory.input();
    let duration = plan.duration.unwrap_or(WINDOW).min(input.duration);
    let longest = plan.steps.iter().max().copied();
    let longest = longest.unwrap_or(SimDuration::from_millis(10));
    // Steps end at command changes anyway; sampling less often than that saves nothing.
    let grid = input
        .commands
        .period()
        .map_or(longest, |period| period.min(longest));
    if duration < grid || grid.is_zero() {
        return Err(StudyError::TooShort {
            duration,
            least: grid,
        });
    }
    Ok(RunContext {
        factory,
        // The last sampling instant.
        end: SimTime::ZERO + grid * (duration.as_nanos() / grid.as_nanos()),
        grid,
        commands: &factory.input().commands,
        incidents,
    })
}

/// Returns the settings of a plant's methods, the coarsest first, without the steps that do not
/// divide the sampling period.
fn settings<'a>(
    plant: &'a PlantOffer,
    plan: &'a PrecisionPlan,
    context: &RunContext<'_>,
) -> impl Iterator<Item = (&'a MethodOffer, MethodSetting)> {
    let grid = context.grid;
    plant.methods.iter().flat_map(move |method| {
        let settings: Vec<MethodSetting> = match method.set_by {
            SettingKind::Step => {
                let steps = plan.steps.iter().copied();
                let dividing = steps.filter(|&step| grid.is_multiple_of(step));
                dividing.map(MethodSetting::Step).collect()
            }
            SettingKind::Tolerance => plan
                .tolerances
                .iter()
                .copied()
                .map(MethodSetting::Tolerance)
                .collect(),
        };
        settings.into_iter().map(move |setting| (method, setting))
    })
}

/// Row with the run time of its first run.
#[derive(Serialize, Deserialize)]
pub(super) struct TimedRow {
    pub(super) row: Row,
    /// \[s\]
    pub(super) run_s: f64,
}

impl Measured for TimedRow {
    fn is_cut(&self) -> bool {
        self.row.cut
    }

    fn note_start(&mut self, start: usize) {
        self.row.start = Some(start);
    }
}

impl Job<'_> {
    /// Returns the references of the plants, with their notes.
    fn references(&mut self, plants: &[PlantOffer]) -> Result<AllReferences, StudyError> {
        let mut known = References::new(self.runs.context, Scales::AS_IS, self.runs.trust());
        let (mut references, mut notes) = (Vec::new(), Vec::new());
        for plant in plants {
            let label = format!("{}, reference", plant.plant);
            let is_studied = model_of(self.runs.context.factory, plant).map(|(_, it)| it);
            let content = ("reference", plant, is_studied);
            let measured = self
                .parts
                .measure(&label, Weight::Reference, &content, |share| {
                    known.of(plant, share)
                });
            let AssignedReference { reference, note } = measured?;
            notes.push(note);
            references.push(reference);
        }
        Ok((references, notes))
    }

    /// Computes the rows of a plant.
    fn plant(
        &mut self,
        plant: &PlantOffer,
        reference: Option<&Reference>,
        note: &ReferenceNote,
    ) -> Result<(), StudyError> {
        let runs = self.runs;
        let mut last: Option<(&str, f64, f64)> = None;
        for (method, setting) in settings(plant, runs.plan, &runs.context) {
            let variant = Variant {
                plant: plant.plant.clone(),
                method: method.name.clone(),
                setting,
                scales: Scales::AS_IS,
            };
            // Run time is proportional to the number of steps.
            let expected_s = match (last, setting.step_s()) {
                (Some((name, step, took)), Some(next)) if name == method.name => took * step / next,
                _ => 0.0,
            };
            let label = format!("{}, {}", plant.plant, method.name);
            let content = ("row", &variant, note);
            let TimedRow { row, run_s } =
                self.parts.measure(&label, Weight::Run, &content, |share| {
                    runs.timed_row(&variant, method, reference, share, expected_s)
                })?;
            if let (Some(step), Status::Ok) = (setting.step_s(), row.status) {
                last = Some((&method.name, step, run_s));
            }
            self.rows.push(row);
        }
        Ok(())
    }
}

impl Runs<'_> {
    /// Computes one row with its run time; a run that is expected to exceed its budget is skipped.
    fn timed_row(
        &self,
        variant: &Variant,
        method: &MethodOffer,
        reference: Option<&Reference>,
        share: Share,
        expected_s: f64,
    ) -> TimedRow {
        let row = Row::new(RowKind::Integration, variant);
        if expected_s > share.seconds {
            let why = format!(
                "too slow: it would take {}, its budget is {}",
                si(expected_s, "s"),
                si(share.seconds, "s")
            );
            return TimedRow {
                row: row.cut_off(why),
                run_s: 0.0,
            };
        }
        let incidents = self.context.incidents;
        let found = incidents.guarded(|| Ok(self.row(variant, method, reference, share)));
        let (row, run_s) = found.unwrap_or_else(|why| (row.ended(Status::Failed, why), 0.0));
        TimedRow { row, run_s }
    }

    /// Computes one row and returns it with the run time \[s\].
    fn row(
        &self,
        variant: &Variant,
        method: &MethodOffer,
        reference: Option<&Reference>,
        share: Share,
    ) -> (Row, f64) {
        let mut row = Row::new(RowKind::Integration, variant);
        let most = reference.map_or(f64::INFINITY, |reference| {
            RUNAWAY * reference.trace.kinetic_bound()
        });
        let recorded = self
            .context
            .record(variant, share, |kinetic| kinetic > most);
        let (trace, ending) = match recorded {
            Ok(recorded) => recorded,
            Err(why) => return (row.ended(Status::Failed, why), 0.0),
        };
        row.note_work(&trace.work, trace.reached_s());
        // An engine's step alone keeps no energy balance.
        row.energy_residual_j = (!method.step_only).then_some(trace.residual);
        row.drift_m = trace.violation;
        if let Ending::Stopped(at) = ending {
            row.note_time(trace.run_s, trace.reached_s(), 1);
            let why = format!(
                "its kinetic energy is more than {RUNAWAY} times the available energy at {}",
                instant(at)
            );
            return (row.ended(Status::Unstable, why), trace.run_s);
        }
        if let Some((status, why)) = ended(&ending, share) {
            row.note_time(trace.run_s, trace.reached_s(), 1);
            row.cut = matches!(ending, Ending::OverBudget(_));
            return (row.ended(status, why), trace.run_s);
        }
        if reference.is_some_and(|reference| reference.variant == *variant) {
            row.why = Some("this run is the reference".to_owned());
        } else if let Some(reference) = reference {
            Self::compare(&mut row, &trace, reference);
        } else {
            row.why = Some("there is no reference to compare with".to_owned());
        }
        self.time(&mut row, variant, &trace, share);
        (row, trace.run_s)
    }

    fn compare(row: &mut Row, trace: &Trace, reference: &Reference) {
        if let Some(errors) = trace.errors(&reference.trace) {
            row.note_errors(&errors);
            row.at_floor = errors.foot_rms <= reference.floor_rms();
        } else {
            row.why = Some("it has no foot in common with the reference".to_owned());
        }
        let until_s = reference.trace.trusted_s();
        let events = [trace, &reference.trace].map(|trace| trace.events_until(until_s));
        if let Some(errors) = events::compare(events[0], events[1]) {
            row.event_time_error_s = errors.time_max_s;
            // A method without event location reports none.
            row.events = (errors.count > 0).then_some(errors.count as u64);
            row.events_expected = Some(errors.expected as u64);
        }
    }

    /// Measures the run time of a variant that completes: the median of several runs without
    /// sampling, of fewer if they are slow.
    fn time(&self, row: &mut Row, variant: &Variant, trace: &Trace, share: Share) {
        let mut times = Vec::new();
        let mut used_s = trace.run_s;
        for _ in 0..self.plan.repetitions.max(1) {
            if used_s + trace.run_s > share.seconds {
                break;
            }
            let plant_run = self.context.plant_run(share);
            let timed = self
                .context
                .with_plant(variant, |plant| plant_run.timed(plant));
            let Ok((_, run_s)) = timed else {
                break;
            };
            if share.deadline.passed() {
                break;
            }
            used_s += run_s;
            times.push(run_s);
        }
        if times.is_empty() {
            times.push(trace.run_s);
        }
        times.sort_by(f64::total_cmp);
        row.note_time(
            times[times.len() / 2],
            trace.reached_s(),
            times.len() as u64,
        );
    }
}
