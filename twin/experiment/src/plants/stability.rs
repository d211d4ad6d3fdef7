//! Study of stability: the largest stable step of a method, and what limits it (thesis, section
//! 2.5.1).

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_report::number::duration;
use twinrig_rig::{MethodOffer, MethodSetting, PlantOffer, Scales, SettingKind, Variant};

use crate::budget::{Budget, Share, Weight};
use crate::error::StudyError;
use crate::incidents::Incidents;
use crate::measured::{Measuring, Parts};
use crate::plants::commands::Commands;
use crate::plants::criteria;
use crate::plants::factor::Factor;
use crate::plants::factory::PlantFactory;
use crate::plants::reference::{Reference, RunContext, Trust};
use crate::plants::references::{AssignedReference, References};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::search::{Probe, Range, SearchResult, search};
use crate::plants::stability_job::Runs;
use crate::plants::stability_plan::StabilityPlan;
use crate::plants::study::{Study, StudyKind};
use crate::plants::trial::{SAMPLE_PERIOD, STEPS_MOST};

/// Greatest disagreement of a reference and its check, as a share of the accuracy limit.
const REFERENCE_MARGIN: f64 = 0.1;
/// Sampling period of the references, which are interpolated between samples.
const REFERENCE_GRID: SimDuration = SimDuration::from_micros(500);
/// Finds the largest stable step of each method of each plant, and what limits it.
///
/// # Errors
/// [`StudyError`] if there is nothing to study, or if the observer stopped the study.
pub fn stability<'m>(
    factory: &dyn PlantFactory,
    plan: &StabilityPlan,
    measuring: impl Into<Measuring<'m>>,
) -> Result<Study, StudyError> {
    let input = factory.input();
    let plants = factory.plants();
    if plants.is_empty() {
        return Err(StudyError::NoPlant);
    }
    if plan.duration < SAMPLE_PERIOD * 8 {
        return Err(StudyError::TooShort {
            duration: plan.duration,
            least: SAMPLE_PERIOD * 8,
        });
    }
    let (scales, left_out) = sweeps(factory, plan);
    let parts = scales.iter().flat_map(|&scales| {
        let of_plant = move |plant: &PlantOffer| 1 + methods(plant, scales).count();
        plants_with(plants, scales).map(of_plant)
    });
    let parts = parts.sum();
    let speeds = scales.iter().map(|scales| scales.speed);
    let commands: Vec<Commands> = speeds.map(|speed| input.commands.at_speed(speed)).collect();
    let end = SimTime::ZERO + plan.duration;
    let mut study = Study::new(StudyKind::Stability, factory, end, REFERENCE_GRID);
    study.budget_s = plan.budget_s;
    study.left_out.extend(left_out);
    study.criteria = criteria::of(plan, input.commands.period());
    let incidents = Incidents::default();
    let context = RunContext {
        factory,
        end,
        grid: REFERENCE_GRID,
        commands: &input.commands,
        incidents: &incidents,
    };
    let budget = Budget::new(plan.budget_s, &[(Weight::Run, parts)]);
    // The factors vary the scales of the parts.
    let scope = StabilityPlan {
        factors: Vec::new(),
        values: None,
        budget_s: 0.0,
        ..plan.clone()
    };
    let mut measuring = measuring.into();
    let mut parts = Parts::new(budget, &mut measuring, &incidents, &scope);
    let trust = Trust {
        apart_m: plan.wrong_m * REFERENCE_MARGIN,
        rough: true,
    };
    for (&scales, commands) in scales.iter().zip(&commands) {
        let runs = Runs {
            context: RunContext {
                commands,
                ..context
            },
            plan,
        };
        // The reference takes its forces from no table.
        let exact = Scales {
            cells: None,
            ..scales
        };
        let mut known = References::new(runs.context, exact, trust);
        for plant in plants_with(plants, scales) {
            // Its trace is large: it is simulated again at each start.
            let share = parts.begin(&plant.plant.label(), Weight::Run)?;
            let AssignedReference { reference, note } = known.of(plant, share);
            for method in methods(plant, scales) {
                let label = format!("{}, {}", plant.plant, method.name);
                let content = (&plant.plant, method, scales, &note);
                let row = parts.measure(&label, Weight::Run, &content, |share| {
                    let reference = reference.as_deref();
                    let row = || Ok(runs.row(plant, method, scales, reference, share));
                    let row = incidents.guarded(row);
                    row.unwrap_or_else(|why| runs.failed(plant, method, scales, why))
                })?;
                study.rows.push(row);
            }
            if scales == Scales::AS_IS {
                study.references.push(note);
            }
        }
    }
    study.starts = parts.finish()?;
    study.panics = incidents.into_panics();
    study.mark_contradictions();
    Ok(study)
}

/// Returns the methods of a plant that run with these changes.
fn methods(plant: &PlantOffer, scales: Scales) -> impl Iterator<Item = &MethodOffer> {
    let concerned = move |method: &&MethodOffer| scales.cells.is_none() || method.tabulated;
    plant.complete_methods().filter(concerned)
}

/// Returns the plants that run with these changes.
fn plants_with(plants: &[PlantOffer], scales: Scales) -> impl Iterator<Item = &PlantOffer> {
    let complete = move |plant: &&PlantOffer| methods(plant, scales).next().is_some();
    plants.iter().filter(complete).filter(move |plant| {
        if plant.plant.is_compliant() {
            // How a compliant sole rebounds follows from its damping.
            scales.restitution.is_none()
        } else {
            !scales.only_compliant()
        }
    })
}

/// Returns the scales of all sweeps, each once, and the factors without effect, with the reason.
fn sweeps(factory: &dyn PlantFactory, plan: &StabilityPlan) -> (Vec<Scales>, Vec<String>) {
    let mut scales = vec![Scales::AS_IS];
    let mut left_out = Vec::new();
    let mut plants = factory.plants().iter();
    let any_compliant = plants.any(|plant| plant.plant.is_compliant());
    let mut methods = factory
        .plants()
        .iter()
        .flat_map(PlantOffer::complete_methods);
    let any_table = methods.any(|method| method.tabulated);
    for factor in &plan.factors {
        let is_of_table = *factor == Factor::Cells;
        if factor.is_of_compliance() && !any_compliant || is_of_table && !any_table {
            continue;
        }
        if let Some(why) = factor.ineffective_in(factory.input()) {
            left_out.push(format!("{}: {why}", factor.name()));
            continue;
        }
        let values = plan.values.as_deref().unwrap_or(factor.values());
        for &value in values {
            let scaled = factor.scales(value);
            if !scales.contains(&scaled) {
                scales.push(scaled);
            }
        }
    }
    // Compliant plants first: they are fast, and the budget of later rows is what others leave.
    scales.sort_by_key(|scales| (*scales != Scales::AS_IS, !scales.only_compliant()));
    (scales, left_out)
}

impl Runs<'_> {
    fn row(
        &self,
        plant: &PlantOffer,
        method: &MethodOffer,
        scales: Scales,
        reference: Option<&Reference>,
        share: Share,
    ) -> Row {
        let variant = |setting| Variant {
            plant: plant.plant.clone(),
            method: method.name.clone(),
            setting,
            scales,
        };
        match method.set_by {
            SettingKind::Tolerance => self.adaptive(
                &variant(MethodSetting::Tolerance(self.plan.tolerance)),
                reference,
                share,
            ),
            SettingKind::Step => {
                let commands = self.context.commands.period();
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

    /// Returns the row of a panic in the study itself.
    fn failed(&self, plant: &PlantOffer, method: &MethodOffer, scales: Scales, why: String) -> Row {
        let variant = Variant {
            plant: plant.plant.clone(),
            method: method.name.clone(),
            setting: match method.set_by {
                SettingKind::Tolerance => MethodSetting::Tolerance(self.plan.tolerance),
                SettingKind::Step => MethodSetting::Step(self.plan.least),
            },
            scales,
        };
        Row::new(RowKind::Stability, &variant).ended(Status::Failed, why)
    }

    /// Returns the row of a search.
    fn searched(
        &self,
        found: &SearchResult,
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
                self.largest_accurate(&variant, stable, reference, share)
            };
        }
        self.time(&mut row, &variant, stable, share);
        row
    }

    /// Returns the longest step below `inaccurate` that is also accurate, if known \[s\].
    fn largest_accurate(
        &self,
        variant: &Variant,
        inaccurate: SimDuration,
        reference: Option<&Reference>,
        share: Share,
    ) -> Option<f64> {
        // An answer requires the simulation of the whole compared duration.
        let compared = self.plan.compared.unwrap_or(self.plan.duration);
        let range = Range {
            least: self.plan.least.max(compared / STEPS_MOST).min(inaccurate),
            most: inaccurate,
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
        let accurate = found.stable.filter(|_| found.cut.is_none());
        accurate.map(|step| step.as_nanos() as f64 / 1e9)
    }

    /// Returns the row of an adaptive method.
    fn adaptive(&self, variant: &Variant, reference: Option<&Reference>, share: Share) -> Row {
        let mut row = Row::new(RowKind::Stability, variant);
        match self.probe(variant, SAMPLE_PERIOD, reference, share) {
            Probe::Stable => {
                self.compare(&mut row, variant, SAMPLE_PERIOD, reference, share);
                self.time(&mut row, variant, SAMPLE_PERIOD, share);
                row
            }
            Probe::Unstable(why) => row.ended(Status::Unstable, why),
            Probe::Refused(why) => row.ended(Status::Refused, why),
            Probe::Unknown(why) => row.ended(Status::Failed, why),
            Probe::OverBudget(why) => row.cut_off(why),
        }
    }
}
