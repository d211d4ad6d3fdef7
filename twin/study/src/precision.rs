//! Error against run time.

use twinrig_kernel::{SimDuration, SimTime};

use crate::budget::{Budget, Share};
use crate::error::StudyError;
use crate::events;
use crate::factory::{
    MethodOffer, MethodSetting, PlantFactory, PlantOffer, Scales, SetBy, Variant,
};
use crate::models::limit_pair;
use crate::number::{instant, si};
use crate::panics::Panics;
use crate::plant_run::Ending;
use crate::progress::ProgressObserver;
use crate::reference::{Reference, Stage, Trust, ended};
use crate::row::{Row, RowKind, Status};
use crate::shared::{References, Standard};
use crate::study::{Study, StudyKind};
use crate::trace::Trace;
use crate::transport;

/// How precision is studied.
#[derive(Clone, Debug)]
pub struct PrecisionPlan {
    /// How much of the scene; none: its first 300 ms, as far as it goes.
    pub duration: Option<SimDuration>,
    /// Steps, the longest first. What is compared is compared at multiples of the longest.
    pub steps: Vec<SimDuration>,
    /// Tolerances, the loosest first.
    pub tolerances: Vec<f64>,
    /// Factors of the masses of the segments at which a plant without is compared with one that has them.
    pub masses: Vec<f64>,
    /// Runs whose median is the run time.
    pub repetitions: u64,
    /// What the study may take in all \[s\]. What is cut for it is a row, too.
    pub budget_s: f64,
}

impl Default for PrecisionPlan {
    fn default() -> Self {
        let micros = [10_000, 5_000, 2_000, 1_000, 500, 200, 100, 50, 20, 10];
        Self {
            duration: None,
            steps: micros.map(SimDuration::from_micros).into(),
            tolerances: vec![1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11],
            masses: vec![1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4, 0.0],
            repetitions: 7,
            budget_s: 200.0,
        }
    }
}

/// So much of a scene is studied where nobody says how much: what the thesis shows of its models (figure 2.5).
const WINDOW: SimDuration = SimDuration::from_millis(300);
/// References are trusted as long as their checks are this near: to what is aimed for, and where feet are thrown on the
/// ground, which no two methods do alike for long, to a tenth of a millimetre \[m\].
const NEAR_M: f64 = 1e-6;
const NEAR_ON_GROUND_M: f64 = 1e-4;
/// A run whose kinetic energy exceeds all that its reference had to give so many times is unstable.
pub(crate) const RUNAWAY: f64 = 100.0;

/// Studies how precise the methods of the plants are, and what they take for it.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or `progress` ended it.
pub fn precision(
    factory: &dyn PlantFactory,
    plan: &PrecisionPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<Study, StudyError> {
    let plants = factory.plants();
    if plants.is_empty() {
        return Err(StudyError::NoPlant);
    }
    let panics = Panics::default();
    let stage = stage(factory, plan, &panics)?;
    let rows: usize = plants
        .iter()
        .map(|plant| settings(plant, plan, &stage).count())
        .sum();
    let compared = plants.len() - 1;
    // What walks is compared by its footsteps: what vanishes there with the mass is drowned by what chance makes of it.
    let walks = stage.factory.scene().ground && stage.factory.scene().commands.change();
    let limits = match limit_pair(factory) {
        Some(_) if walks => plants.len(),
        Some(_) => plan.masses.len(),
        None => 0,
    };
    let walked = if walks { transport::parts(plants) } else { 0 };
    let mut job = Job {
        stage,
        plan,
        budget: Budget::new(
            plan.budget_s,
            rows + plants.len() + compared.min(1) * limits + walked,
            plants.len() + walked,
        ),
        progress,
        rows: Vec::new(),
    };
    let mut known = References::new(stage, Scales::AS_IS, trust(&stage));
    let mut references = Vec::new();
    let mut notes = Vec::new();
    for plant in plants {
        let share = job.begin_heavy(&format!("{}, reference", plant.name))?;
        let Standard { reference, note } = known.of(plant, share);
        notes.push(note);
        references.push(reference);
    }
    let transports = if walks {
        job.transports(plants)?
    } else {
        Vec::new()
    };
    for (plant, reference) in plants.iter().zip(&references) {
        job.plant(plant, reference.as_deref())?;
    }
    job.models(plants, &references);
    let mut footsteps = Vec::new();
    if walks {
        footsteps = job.footsteps(plants, &references)?;
    } else {
        job.limit()?;
    }
    job.budget.finished()?;
    let rows = std::mem::take(&mut job.rows);
    let mut study = Study::new(StudyKind::Precision, factory, stage.end, stage.grid);
    study.references = notes;
    study.rows = rows;
    study.footsteps = footsteps;
    study.transports = transports;
    study.budget_s = plan.budget_s;
    study.panics = panics.into_all();
    study.mark_contradictions();
    Ok(study)
}

/// What is compared, and where.
fn stage<'a>(
    factory: &'a dyn PlantFactory,
    plan: &PrecisionPlan,
    panics: &'a Panics,
) -> Result<Stage<'a>, StudyError> {
    let scene = factory.scene();
    let duration = plan.duration.unwrap_or(WINDOW).min(scene.duration);
    let longest = plan.steps.iter().max().copied();
    let longest = longest.unwrap_or(SimDuration::from_millis(10));
    // Commands cut the steps anyway; between two of them nothing is gained by looking less often.
    let grid = scene
        .commands
        .period()
        .map_or(longest, |period| period.min(longest));
    if duration < grid || grid.is_zero() {
        return Err(StudyError::TooShort {
            duration,
            least: grid,
        });
    }
    Ok(Stage {
        factory,
        // The last instant of the grid.
        end: SimTime::ZERO + grid * (duration.as_nanos() / grid.as_nanos()),
        grid,
        panics,
    })
}

/// How closely references and their checks have to agree.
pub(crate) fn trust(stage: &Stage<'_>) -> Trust {
    Trust {
        apart_m: if stage.factory.scene().ground {
            NEAR_ON_GROUND_M
        } else {
            NEAR_M
        },
        rough: false,
    }
}

/// The settings of a plant's methods, the coarsest first; no step that the grid would cut.
fn settings<'a>(
    plant: &'a PlantOffer,
    plan: &'a PrecisionPlan,
    stage: &Stage<'_>,
) -> impl Iterator<Item = (&'a MethodOffer, MethodSetting)> {
    let grid = stage.grid;
    plant.methods.iter().flat_map(move |method| {
        let settings: Vec<MethodSetting> = match method.set_by {
            SetBy::Step => {
                let steps = plan.steps.iter().copied();
                let whole = steps.filter(|&step| grid.is_multiple_of(step));
                whole.map(MethodSetting::Step).collect()
            }
            SetBy::Tolerance => plan
                .tolerances
                .iter()
                .copied()
                .map(MethodSetting::Tolerance)
                .collect(),
        };
        settings.into_iter().map(move |setting| (method, setting))
    })
}

/// A study on its way.
pub(crate) struct Job<'a> {
    pub(crate) stage: Stage<'a>,
    pub(crate) plan: &'a PrecisionPlan,
    pub(crate) budget: Budget,
    pub(crate) progress: &'a mut dyn ProgressObserver,
    pub(crate) rows: Vec<Row>,
}

impl Job<'_> {
    pub(crate) fn begin(&mut self, doing: &str) -> Result<Share, StudyError> {
        self.begin_part(doing, false)
    }

    /// A reference, or all of a walk.
    pub(crate) fn begin_heavy(&mut self, doing: &str) -> Result<Share, StudyError> {
        self.begin_part(doing, true)
    }

    fn begin_part(&mut self, doing: &str, heavy: bool) -> Result<Share, StudyError> {
        let share = self.budget.next(heavy);
        let (part, of) = self.budget.progress();
        if self.progress.at(part, of, doing) {
            Ok(share)
        } else {
            Err(StudyError::Interrupted { done: part, of })
        }
    }

    /// The rows of a plant.
    fn plant(
        &mut self,
        plant: &PlantOffer,
        reference: Option<&Reference>,
    ) -> Result<(), StudyError> {
        let plan = self.plan;
        let stage = self.stage;
        let mut last: Option<(&str, f64, f64)> = None;
        for (method, setting) in settings(plant, plan, &stage) {
            let share = self.begin(&format!("{}, {}", plant.name, method.name))?;
            let variant = Variant {
                plant: plant.name.clone(),
                method: method.name.clone(),
                setting,
                scales: Scales::AS_IS,
            };
            // A method takes in proportion to its steps, so what would take too long need not be tried.
            let expected = match (last, setting.step_s()) {
                (Some((name, step, took)), Some(next)) if name == method.name => took * step / next,
                _ => 0.0,
            };
            if expected > share.seconds {
                let why = format!(
                    "too slow: it would take {}, its budget is {}",
                    si(expected, "s"),
                    si(share.seconds, "s")
                );
                self.rows
                    .push(Row::new(RowKind::Integration, &variant).cut_off(why));
                continue;
            }
            let panics = self.stage.panics;
            let row = panics.guarded(|| Ok(self.row(&variant, reference, share)));
            let (row, took_s) = row.unwrap_or_else(|why| {
                let row = Row::new(RowKind::Integration, &variant);
                (row.ended(Status::Failed, why), 0.0)
            });
            if let (Some(step), Status::Ok) = (setting.step_s(), row.status) {
                last = Some((&method.name, step, took_s));
            }
            self.rows.push(row);
        }
        Ok(())
    }

    /// One row, and the time that its run took \[s\].
    fn row(&self, variant: &Variant, reference: Option<&Reference>, share: Share) -> (Row, f64) {
        let mut row = Row::new(RowKind::Integration, variant);
        let most = reference.map_or(f64::INFINITY, |reference| {
            RUNAWAY * reference.trace.kinetic_bound()
        });
        let recorded = self.stage.record(variant, share, |kinetic| kinetic > most);
        let (trace, ending) = match recorded {
            Ok(recorded) => recorded,
            Err(why) => return (row.ended(Status::Failed, why), 0.0),
        };
        row.note_work(&trace.work, trace.reached_s());
        row.energy_residual_j = Some(trace.residual);
        row.drift_m = trace.drift;
        if let Ending::Enough(at) = ending {
            row.note_time(trace.took_s, trace.reached_s(), 1);
            let why = format!(
                "its kinetic energy is more than {RUNAWAY} times all that there is to give at {}",
                instant(at)
            );
            return (row.ended(Status::Unstable, why), trace.took_s);
        }
        if let Some((status, why)) = ended(&ending, share) {
            row.note_time(trace.took_s, trace.reached_s(), 1);
            row.cut = matches!(ending, Ending::TooSlow(_));
            return (row.ended(status, why), trace.took_s);
        }
        if reference.is_some_and(|reference| reference.variant == *variant) {
            row.why = Some("this run is the reference".to_owned());
        } else if let Some(reference) = reference {
            Self::compare(&mut row, &trace, reference);
        } else {
            row.why = Some("there is no reference to compare with".to_owned());
        }
        self.time(&mut row, variant, &trace, share);
        (row, trace.took_s)
    }

    fn compare(row: &mut Row, trace: &Trace, reference: &Reference) {
        if let Some(errors) = trace.errors(&reference.trace) {
            row.note_errors(&errors);
            row.at_floor = errors.foot_rms <= reference.floor_rms();
        } else {
            row.why = Some("it tells of no foot that the reference has, too".to_owned());
        }
        let until_s = reference.trace.trusted_s();
        let events = [trace, &reference.trace].map(|trace| trace.events_until(until_s));
        if let Some(errors) = events::compare(events[0], events[1]) {
            row.event_time_error_s = errors.time_max_s;
            // A method that looks for no events tells of none.
            row.events = (errors.count > 0).then_some(errors.count as u64);
            row.events_expected = Some(errors.expected as u64);
        }
    }

    /// Times a variant that is known to come to its end: the median of several runs without looking, of fewer where they
    /// take long.
    fn time(&self, row: &mut Row, variant: &Variant, trace: &Trace, share: Share) {
        let mut times = Vec::new();
        let mut spent_s = trace.took_s;
        for _ in 0..self.plan.repetitions.max(1) {
            if spent_s + trace.took_s > share.seconds {
                break;
            }
            let plant_run = self.stage.plant_run(share);
            let timed = self
                .stage
                .with_plant(variant, |plant| plant_run.timed(plant));
            let Ok((_, took_s)) = timed else {
                break;
            };
            if share.deadline.passed() {
                break;
            }
            spent_s += took_s;
            times.push(took_s);
        }
        if times.is_empty() {
            times.push(trace.took_s);
        }
        times.sort_by(f64::total_cmp);
        row.note_time(
            times[times.len() / 2],
            trace.reached_s(),
            times.len() as u64,
        );
    }
}
