//! The largest step at which a method is stable, and what limits it (thesis, section 2.5.1).

use twinrig_kernel::{SimDuration, SimTime};

use crate::budget::{Budget, Share};
use crate::criteria;
use crate::error::StudyError;
use crate::factory::{
    MethodOffer, MethodSetting, PlantFactory, PlantOffer, Scales, SetBy, Variant,
};
use crate::number::duration;
use crate::panics::Panics;
use crate::progress::ProgressObserver;
use crate::reference::{Reference, Stage, Trust};
use crate::row::{Row, RowKind, Status};
use crate::search::{Found, Probe, Range, search};
use crate::shared::{References, Standard};
use crate::study::{Study, StudyKind};
use crate::sweep::Factor;
use crate::trial::{LOOK, STEPS_MOST};

/// How stability is studied.
#[derive(Clone, Debug)]
pub struct StabilityPlan {
    /// How long a run is that is to stay bounded. It may be longer than the scene, whose last commands then hold.
    pub duration: SimDuration,
    /// The first part of it is compared with a reference; none: the scene's length, at most the whole run.
    pub compared: Option<SimDuration>,
    /// The shortest step that is tried.
    pub least: SimDuration,
    /// The longest.
    pub most: SimDuration,
    /// The search ends when the shortest unstable step is no more than so many times the longest stable one.
    pub ratio: f64,
    /// A stable step whose foot is further than this from the reference is wrong \[m\], RMS.
    pub wrong_m: f64,
    /// The tolerance of methods that choose their steps.
    pub tolerance: f64,
    /// What is varied.
    pub factors: Vec<Factor>,
    /// What the study may take in all \[s\].
    pub budget_s: f64,
}

impl Default for StabilityPlan {
    fn default() -> Self {
        Self {
            duration: SimDuration::from_secs(2),
            compared: Some(SimDuration::from_millis(300)),
            least: SimDuration::from_micros(1),
            most: SimDuration::from_millis(100),
            ratio: 1.05,
            wrong_m: 1e-3,
            tolerance: 1e-6,
            factors: Factor::ALL.into(),
            budget_s: 200.0,
        }
    }
}

/// Right is told from wrong by references that are known to this share of the error between.
const TOLD_APART: f64 = 0.1;
/// References are sampled so often, and interpolated between.
const REFERENCE_GRID: SimDuration = SimDuration::from_micros(500);
/// Studies how long the steps of the plants' methods may be, and what limits them.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or `progress` ended it.
pub fn stability(
    factory: &dyn PlantFactory,
    plan: &StabilityPlan,
    progress: &mut dyn ProgressObserver,
) -> Result<Study, StudyError> {
    let scene = factory.scene();
    let plants = factory.plants();
    if plants.is_empty() {
        return Err(StudyError::NoPlant);
    }
    if plan.duration < LOOK * 8 {
        return Err(StudyError::TooShort {
            duration: plan.duration,
            least: LOOK * 8,
        });
    }
    let (scales, left_out) = sweeps(factory, plan);
    let methods: usize = plants.iter().map(|plant| plant.methods.len()).sum();
    let parts = scales.len() * (methods + plants.len());
    let end = SimTime::ZERO + plan.duration;
    let mut study = Study::new(StudyKind::Stability, factory, end, REFERENCE_GRID);
    study.budget_s = plan.budget_s;
    study.left_out.extend(left_out);
    study.criteria = criteria::of(plan, scene.commands.period());
    let panics = Panics::default();
    let mut job = Job {
        stage: Stage {
            factory,
            end,
            grid: REFERENCE_GRID,
            panics: &panics,
        },
        plan,
        budget: Budget::new(plan.budget_s, parts, 0),
        progress,
    };
    let trust = Trust {
        apart_m: plan.wrong_m * TOLD_APART,
        rough: true,
    };
    for &scales in &scales {
        let mut known = References::new(job.stage, scales, trust);
        for plant in plants {
            let share = job.begin(&plant.name)?;
            let Standard { reference, note } = known.of(plant, share);
            if scales == Scales::AS_IS {
                study.references.push(note);
            }
            for method in &plant.methods {
                let share = job.begin(&format!("{}, {}", plant.name, method.name))?;
                let row = panics
                    .guarded(|| Ok(job.row(plant, method, scales, reference.as_deref(), share)));
                let row = row.unwrap_or_else(|why| job.failed(plant, method, scales, why));
                study.rows.push(row);
            }
        }
    }
    job.budget.finished()?;
    study.panics = panics.into_all();
    study.mark_contradictions();
    Ok(study)
}

/// All scenes of all factors, each once, and the factors that say nothing.
fn sweeps(factory: &dyn PlantFactory, plan: &StabilityPlan) -> (Vec<Scales>, Vec<String>) {
    let mut scales = vec![Scales::AS_IS];
    let mut left_out = Vec::new();
    for factor in &plan.factors {
        if let Some(why) = factor.idle_in(factory.scene()) {
            left_out.push(format!("{}: {why}", factor.name()));
            continue;
        }
        for &value in factor.values() {
            let scaled = factor.scales(value);
            if !scales.contains(&scaled) {
                scales.push(scaled);
            }
        }
    }
    (scales, left_out)
}

/// A study on its way.
pub(crate) struct Job<'a> {
    pub(crate) stage: Stage<'a>,
    pub(crate) plan: &'a StabilityPlan,
    budget: Budget,
    progress: &'a mut dyn ProgressObserver,
}

impl Job<'_> {
    fn begin(&mut self, doing: &str) -> Result<Share, StudyError> {
        let share = self.budget.next(false);
        let (part, of) = self.budget.progress();
        if self.progress.at(part, of, doing) {
            Ok(share)
        } else {
            Err(StudyError::Interrupted { done: part, of })
        }
    }

    fn row(
        &self,
        plant: &PlantOffer,
        method: &MethodOffer,
        scales: Scales,
        reference: Option<&Reference>,
        share: Share,
    ) -> Row {
        let variant = |setting| Variant {
            plant: plant.name.clone(),
            method: method.name.clone(),
            setting,
            scales,
        };
        match method.set_by {
            SetBy::Tolerance => self.adaptive(
                &variant(MethodSetting::Tolerance(self.plan.tolerance)),
                reference,
                share,
            ),
            SetBy::Step => {
                let commands = self.stage.factory.scene().commands.period();
                let most = self.plan.most;
                let range = Range {
                    least: self.plan.least,
                    most: commands.map_or(most, |period| period.min(most)),
                    ratio: self.plan.ratio,
                };
                let found = search(range, |step| {
                    self.probe(&variant(MethodSetting::Step(step)), step, reference, share)
                });
                self.searched(&found, variant, reference, share)
            }
        }
    }

    /// The row of what panicked in this study itself.
    fn failed(&self, plant: &PlantOffer, method: &MethodOffer, scales: Scales, why: String) -> Row {
        let variant = Variant {
            plant: plant.name.clone(),
            method: method.name.clone(),
            setting: match method.set_by {
                SetBy::Tolerance => MethodSetting::Tolerance(self.plan.tolerance),
                SetBy::Step => MethodSetting::Step(self.plan.least),
            },
            scales,
        };
        Row::new(RowKind::Stability, &variant).ended(Status::Failed, why)
    }

    /// The row of a search.
    fn searched(
        &self,
        found: &Found,
        variant: impl Fn(MethodSetting) -> Variant,
        reference: Option<&Reference>,
        share: Share,
    ) -> Row {
        let shown = found.stable.unwrap_or(self.plan.least);
        let variant = variant(MethodSetting::Step(shown));
        let mut row = Row::new(RowKind::Stability, &variant);
        row.probes = Some(found.probes);
        row.least_unstable_step_s = found.unstable.map(|step| step.as_nanos() as f64 / 1e9);
        if let Some(cut) = &found.cut {
            let known = match (found.stable, found.unstable) {
                (Some(stable), Some(unstable)) => {
                    format!(
                        "; known: {} is stable, {} is not",
                        duration(stable),
                        duration(unstable)
                    )
                }
                (Some(stable), None) => format!("; known: {} is stable", duration(stable)),
                (None, Some(unstable)) => format!("; known: {} is not stable", duration(unstable)),
                (None, None) => String::new(),
            };
            row.cut = found.slow;
            return row.ended(Status::Failed, format!("{cut}{known}"));
        }
        let Some(stable) = found.stable else {
            let why = found.why.clone().unwrap_or_default();
            let why = format!("not even at {}: {why}", duration(self.plan.least));
            return row.ended(Status::Unstable, why);
        };
        row.largest_stable_step_s = Some(stable.as_nanos() as f64 / 1e9);
        row.why = match (&found.why, found.unstable) {
            (Some(why), Some(unstable)) => Some(format!("at {}: {why}", duration(unstable))),
            _ => Some("the longest step that was tried is stable".to_owned()),
        };
        if let Some(errors) = self.compare(&mut row, &variant, stable, reference, share) {
            row.largest_right_step_s = if errors.foot_rms <= self.plan.wrong_m {
                row.largest_stable_step_s
            } else {
                self.right(&variant, stable, reference, share)
            };
        }
        self.time(&mut row, &variant, stable, share);
        row
    }

    /// The longest step below `wrong` that is right, too \[s\]; none if it is not known.
    fn right(
        &self,
        variant: &Variant,
        wrong: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<f64> {
        // All of what is compared has to be simulated for an answer.
        let whole = self.plan.compared.unwrap_or(self.plan.duration);
        let range = Range {
            least: self.plan.least.max(whole / STEPS_MOST).min(wrong),
            most: wrong,
            ratio: self.plan.ratio,
        };
        let found = search(range, |step| {
            let variant = Variant {
                setting: MethodSetting::Step(step),
                ..variant.clone()
            };
            match self.against(&variant, step, reference, share) {
                Some((_, Some(errors))) if errors.foot_rms <= self.plan.wrong_m => Probe::Stable,
                Some(_) => Probe::Unstable(String::new()),
                None => Probe::Unknown(String::new()),
            }
        });
        let right = found.stable.filter(|_| found.cut.is_none());
        right.map(|step| step.as_nanos() as f64 / 1e9)
    }

    /// The row of a method that chooses its steps.
    fn adaptive(&self, variant: &Variant, reference: Option<&Reference>, share: Share) -> Row {
        let mut row = Row::new(RowKind::Stability, variant);
        match self.probe(variant, LOOK, reference, share) {
            Probe::Stable => {
                self.compare(&mut row, variant, LOOK, reference, share);
                self.time(&mut row, variant, LOOK, share);
                row
            }
            Probe::Unstable(why) => row.ended(Status::Unstable, why),
            Probe::Unknown(why) => row.ended(Status::Failed, why),
            Probe::TooSlow(why) => row.cut_off(why),
        }
    }
}
