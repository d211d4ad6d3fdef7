//! The largest step at which a method is stable, and what limits it (thesis, section 2.5.1).

use twinrig_kernel::{SimDuration, SimTime};

use crate::budget::{Budget, Share};
use crate::criteria;
use crate::error::StudyError;
use crate::number::{duration, instant};
use crate::outing::{Ending, Outing};
use crate::precision::RUNAWAY;
use crate::reference::{self, Reference, ReferenceNote, Stage, Trust, ended};
use crate::row::{Row, RowKind, Status};
use crate::search::{Found, Probe, Range, search};
use crate::study::{Study, StudyKind};
use crate::sweep::Factor;
use crate::trace::{Errors, Trace};
use crate::watcher::Watcher;
use crate::workshop::{Knob, MethodOffer, PlantOffer, Scales, SetBy, Variant, Workshop};

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

/// Kinetic energy grows if its peak in the last quarter of a run exceeds so many times that in the first, and in the last
/// quarter of the reference. It stays, which is no better where it should go, if it exceeds that of the reference by so much
/// and is still this share of what it was in the third: what grows until stops bound it does not explode, and does not rest.
const STAYS: f64 = 0.9;
/// See [`STAYS`].
pub(crate) const GROWN: f64 = 2.0;
/// What is less than this share of the reference's greatest kinetic energy is rest.
pub(crate) const REST: f64 = 1e-6;
/// Right is told from wrong by references that are known to this share of the error between.
const TOLD_APART: f64 = 0.1;
/// References are sampled so often, and interpolated between.
const REFERENCE_GRID: SimDuration = SimDuration::from_micros(500);
/// Kinetic energy is looked at so often, or at each step where those are longer.
const LOOK: SimDuration = SimDuration::from_millis(2);
/// A run ends after so many steps: what is not stable shows by then.
pub(crate) const STEPS_MOST: u64 = 40_000;
/// Runs whose median is the cost of a step.
const REPETITIONS: usize = 3;

/// Studies how long the steps of the plants' methods may be, and what limits them.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or `watcher` ended it.
pub fn stability(
    workshop: &dyn Workshop,
    plan: &StabilityPlan,
    watcher: &mut dyn Watcher,
) -> Result<Study, StudyError> {
    let scene = workshop.scene();
    let plants = workshop.plants();
    if plants.is_empty() {
        return Err(StudyError::NoPlant);
    }
    if plan.duration < LOOK * 8 {
        return Err(StudyError::TooShort {
            duration: plan.duration,
            least: LOOK * 8,
        });
    }
    let (scales, left_out) = sweeps(workshop, plan);
    let methods: usize = plants.iter().map(|plant| plant.methods.len()).sum();
    let parts = scales.len() * (methods + plants.len());
    let end = SimTime::ZERO + plan.duration;
    let mut study = Study::new(StudyKind::Stability, workshop, end, REFERENCE_GRID);
    study.budget_s = plan.budget_s;
    study.left_out = left_out;
    study.criteria = criteria::of(plan, scene.commands.period());
    let mut job = Job {
        stage: Stage {
            workshop,
            end,
            grid: REFERENCE_GRID,
        },
        plan,
        budget: Budget::new(plan.budget_s, parts),
        watcher,
    };
    let trust = Trust {
        apart_m: plan.wrong_m * TOLD_APART,
        rough: true,
    };
    for &scales in &scales {
        for plant in plants {
            let share = job.begin(&plant.name)?;
            let reference = reference::checked(&job.stage, plant, scales, trust, share);
            if scales == Scales::AS_IS {
                study.references.push(match &reference {
                    Ok(reference) => reference.note(),
                    Err(why) => ReferenceNote::missing(&plant.name, why.clone()),
                });
            }
            for method in &plant.methods {
                let share = job.begin(&format!("{}, {}", plant.name, method.name))?;
                let row = job.row(plant, method, scales, reference.as_ref().ok(), share);
                study.rows.push(row);
            }
        }
    }
    Ok(study)
}

/// All scenes of all factors, each once, and the factors that say nothing.
fn sweeps(workshop: &dyn Workshop, plan: &StabilityPlan) -> (Vec<Scales>, Vec<String>) {
    let mut scales = vec![Scales::AS_IS];
    let mut left_out = Vec::new();
    for factor in &plan.factors {
        if let Some(why) = factor.idle_in(workshop.scene()) {
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
struct Job<'a> {
    stage: Stage<'a>,
    plan: &'a StabilityPlan,
    budget: Budget,
    watcher: &'a mut dyn Watcher,
}

impl Job<'_> {
    fn begin(&mut self, doing: &str) -> Result<Share, StudyError> {
        let share = self.budget.next();
        let (part, of) = self.budget.progress();
        if self.watcher.at(part, of, doing) {
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
        let variant = |knob| Variant {
            plant: plant.name.clone(),
            method: method.name.clone(),
            knob,
            scales,
        };
        match method.set_by {
            SetBy::Tolerance => self.adaptive(
                &variant(Knob::Tolerance(self.plan.tolerance)),
                reference,
                share,
            ),
            SetBy::Step => {
                let commands = self.stage.workshop.scene().commands.period();
                let most = self.plan.most;
                let range = Range {
                    least: self.plan.least,
                    most: commands.map_or(most, |period| period.min(most)),
                    ratio: self.plan.ratio,
                };
                let found = search(range, |step| {
                    self.probe(&variant(Knob::Step(step)), step, reference, share)
                });
                self.searched(&found, variant, reference, share)
            }
        }
    }

    /// The row of a search.
    fn searched(
        &self,
        found: &Found,
        variant: impl Fn(Knob) -> Variant,
        reference: Option<&Reference>,
        share: Share,
    ) -> Row {
        let shown = found.stable.unwrap_or(self.plan.least);
        let variant = variant(Knob::Step(shown));
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
                knob: Knob::Step(step),
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

    /// A run over what is compared, and how far it is from the reference.
    fn against(
        &self,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<(Trace, Option<Errors>)> {
        let scene = self.stage.workshop.scene().duration;
        let compared = self.plan.compared.unwrap_or(scene).min(self.plan.duration);
        let stage = Stage {
            grid: looks(step),
            end: SimTime::ZERO + compared.max(looks(step)),
            ..self.stage
        };
        let (trace, ending) = stage.record(variant, share, |_| false).ok()?;
        if matches!(ending, Ending::TooSlow(_)) {
            return None;
        }
        let errors = reference.and_then(|reference| trace.errors_between(&reference.trace));
        let errors = errors.filter(|_| ending == Ending::Whole);
        Some((trace, errors))
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

    /// The end of a run with steps of `step`.
    fn end(&self, step: SimDuration) -> SimTime {
        self.stage.end.min(SimTime::ZERO + step * STEPS_MOST)
    }

    /// Whether a variant with steps of `step` stays bounded.
    fn probe(
        &self,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Probe {
        let end = self.end(step);
        let end_s = end.as_secs_f64();
        let known = reference.map(|reference| {
            let trace = &reference.trace;
            (trace.kinetic_bound(), trace.kinetic_by_quarter(end_s))
        });
        let (peak, [.., late]) = known.unwrap_or((f64::INFINITY, [0.0; 4]));
        let stage = Stage {
            grid: looks(step),
            end,
            ..self.stage
        };
        let recorded = stage.record(variant, share, |kinetic| kinetic > RUNAWAY * peak);
        let (trace, ending) = match recorded {
            Ok(recorded) => recorded,
            Err(why) => return Probe::Unknown(why),
        };
        match &ending {
            Ending::Whole => {}
            Ending::Enough(at) => {
                return Probe::Unstable(format!("kinetic energy runs away at {}", instant(*at)));
            }
            Ending::TooSlow(_) => {
                let why = ended(&ending, share).map(|(_, why)| why);
                return Probe::TooSlow(why.unwrap_or_default());
            }
            Ending::Fault(_) | Ending::NotFinite(_) => {
                let why = ended(&ending, share).map(|(_, why)| why);
                return Probe::Unstable(why.unwrap_or_default());
            }
        }
        let own = trace.kinetic_by_quarter(end_s);
        let [first, .., last] = own;
        let rest = if peak.is_finite() { REST * peak } else { 0.0 };
        if last > GROWN * first.max(late) + rest {
            return Probe::Unstable(format!(
                "kinetic energy grows: its peak is {first:.2e} J in the first quarter and {last:.2e} J in the last"
            ));
        }
        let should_go = known.is_some_and(|(_, quarters)| !stays(quarters));
        if should_go && stays(own) && last > GROWN * late + rest {
            return Probe::Unstable(format!(
                "kinetic energy stays: its peak in the last quarter is {last:.2e} J, and should have gone to {late:.2e} J"
            ));
        }
        Probe::Stable
    }

    /// Notes how far a stable step is from the reference.
    fn compare(
        &self,
        row: &mut Row,
        variant: &Variant,
        step: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<Errors> {
        let (trace, errors) = self.against(variant, step, reference, share)?;
        row.note_work(&trace.work, trace.reached_s());
        row.energy_residual_j = Some(trace.residual);
        row.drift_m = trace.drift;
        if let Some(errors) = &errors {
            row.note_errors(errors);
            row.wrong = errors.foot_rms > self.plan.wrong_m;
        } else {
            let why = "there is no reference";
            row.why = Some(match row.why.take() {
                Some(before) => format!("{before}; {why}"),
                None => why.to_owned(),
            });
        }
        errors
    }

    /// What a step costs.
    fn time(&self, row: &mut Row, variant: &Variant, step: SimDuration, share: Share) {
        let Some(mean) = row.mean_step_s.filter(|&mean| mean > 0.0) else {
            return;
        };
        let mut times = Vec::new();
        let mut simulated_s = 0.0;
        for _ in 0..REPETITIONS {
            let Ok(mut plant) = self.stage.workshop.build(variant) else {
                return;
            };
            let grid = looks(step);
            let whole = self.end(step).as_nanos() / grid.as_nanos();
            let outing = Outing {
                grid,
                end: SimTime::ZERO + grid * whole,
                ..self.stage.outing(share)
            };
            let (ending, took_s) = outing.timed(&mut *plant);
            if ending != Ending::Whole {
                break;
            }
            simulated_s = outing.end.as_secs_f64();
            times.push(took_s);
        }
        times.sort_by(f64::total_cmp);
        if let Some(&median) = times.get(times.len() / 2) {
            row.note_time(median, simulated_s, times.len() as u64);
            row.cost_per_step_s = Some(median / simulated_s * mean);
        }
    }
}

/// Whether kinetic energy, by its peaks in the quarters of a run, is not on its way to rest.
fn stays([_, _, third, last]: [f64; 4]) -> bool {
    last > STAYS * third
}

/// How often a run with steps of `step` is looked at: at whole steps.
fn looks(step: SimDuration) -> SimDuration {
    let nanos = step.as_nanos().max(1);
    SimDuration::from_nanos(nanos) * (LOOK.as_nanos() / nanos).max(1)
}
