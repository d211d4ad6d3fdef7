//! References of plants, and the extent to which they are trusted.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_report::number::{instant, method_setting, si};
use twinrig_rig::{MethodSetting, PlantOffer, Scales, SettingKind, Variant};
use twinrig_runtime::{PartKind, Plant, in_part};

use crate::budget::Share;
use crate::incidents::Incidents;
use crate::measured::Measured;
use crate::plants::commands::Commands;
use crate::plants::factory::PlantFactory;
use crate::plants::plant_run::{Ending, PlantRun};
use crate::plants::reference_note::{CheckNote, ReferenceNote};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::trace::{Errors, Trace};

/// Finest settings, for methods that declare no reference setting.
const FINEST_STEP: SimDuration = SimDuration::from_micros(5);
const FINEST_TOLERANCE: f64 = 1e-12;

/// Run that other runs of the same plant are compared with.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Reference {
    pub(crate) variant: Variant,
    pub(crate) trace: Trace,
    /// Check run, by another method or by the same at a coarser setting, and its distance from the
    /// reference over the time for which the two agree.
    pub(crate) check: Option<(Variant, Errors)>,
    /// End of their agreement, if it is before the end of the run \[s\].
    pub(crate) until_s: Option<f64>,
}

impl Measured for Reference {}

/// Environment of the runs: factory, end time, sampling period and panic log.
#[derive(Clone, Copy)]
pub(crate) struct RunContext<'a> {
    pub(crate) factory: &'a dyn PlantFactory,
    pub(crate) end: SimTime,
    pub(crate) grid: SimDuration,
    pub(crate) commands: &'a Commands,
    pub(crate) incidents: &'a Incidents,
}

impl RunContext<'_> {
    /// Builds a variant, runs it and records its trace.
    ///
    /// # Errors
    /// The reason why the variant could not be built.
    pub(crate) fn record(
        &self,
        variant: &Variant,
        share: Share,
        stop: impl FnMut(f64) -> bool,
    ) -> Result<(Trace, Ending), String> {
        let plant_run = self.plant_run(share);
        self.with_plant(variant, |plant| Trace::record(plant, &plant_run, stop))
    }

    /// Builds a variant and applies `action` to it.
    ///
    /// # Errors
    /// The reason why the variant could not be built, or its panic.
    pub(crate) fn with_plant<R>(
        &self,
        variant: &Variant,
        action: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        self.with_built(variant, |factory| factory.build(variant), action)
    }

    /// Builds a variant whose outputs include its drives, and applies `action` to it.
    pub(crate) fn with_drives<R>(
        &self,
        variant: &Variant,
        action: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        self.with_built(
            variant,
            |factory| factory.build_with_drives(variant),
            action,
        )
    }

    /// Builds a variant whose outputs include the contacts of its feet, and applies `action` to it.
    pub(crate) fn with_contacts<R>(
        &self,
        variant: &Variant,
        action: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        let build = |factory: &dyn PlantFactory| factory.build_with_contacts(variant);
        self.with_built(variant, build, action)
    }

    fn with_built<R>(
        &self,
        variant: &Variant,
        build: impl FnOnce(&dyn PlantFactory) -> Result<Box<dyn Plant>, String>,
        action: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        self.incidents.guarded(|| {
            in_part(PartKind::Plant, &variant.plant.name, || {
                let mut plant = build(self.factory)?;
                Ok(action(&mut *plant))
            })
        })
    }

    pub(crate) fn plant_run(&self, share: Share) -> PlantRun<'_> {
        PlantRun {
            commands: self.commands,
            end: self.end,
            grid: self.grid,
            deadline: share.deadline,
            incidents: self.incidents,
        }
    }

    /// Returns the trace of a variant that completes the run.
    fn completed(&self, variant: &Variant, share: Share) -> Result<Trace, String> {
        let (trace, ending) = self.record(variant, share, |_| false)?;
        match ended(&ending, share) {
            None => Ok(trace),
            Some((_, why)) => Err(why),
        }
    }
}

/// Returns status and reason of a run that failed; `None` for one that completed or was stopped by
/// the observer.
pub(crate) fn ended(ending: &Ending, share: Share) -> Option<(Status, String)> {
    match ending {
        Ending::Completed | Ending::Stopped(_) => None,
        Ending::Fault(fault) => Some((Status::Failed, fault.to_string())),
        Ending::NotFinite(at) => Some((
            Status::Unstable,
            format!("a value is not finite at {}", instant(*at)),
        )),
        Ending::OverBudget(at) => Some((
            Status::Failed,
            format!(
                "too slow: at {} after {:.1} s, its budget",
                instant(*at),
                share.seconds
            ),
        )),
    }
}

/// Returns the variants that qualify as references, the best first.
fn trusted(offer: &PlantOffer, scales: Scales) -> Vec<Variant> {
    let variant = |method: &str, setting| Variant {
        plant: offer.plant.clone(),
        method: method.to_owned(),
        setting,
        scales,
    };
    let named = offer.methods.iter().filter_map(|method| {
        let setting = method.reference?;
        Some(variant(&method.name, setting))
    });
    let others = offer
        .complete_methods()
        .filter(|method| method.reference.is_none());
    let others = others.map(|method| {
        let setting = match method.set_by {
            SettingKind::Step => MethodSetting::Step(FINEST_STEP),
            SettingKind::Tolerance => MethodSetting::Tolerance(FINEST_TOLERANCE),
        };
        variant(&method.name, setting)
    });
    let named: Vec<Variant> = named.collect();
    if named.is_empty() {
        others.collect()
    } else {
        named
    }
}

/// Required agreement of a reference and its check.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trust {
    /// Greatest distance at which both are trusted \[m\].
    pub(crate) apart_m: f64,
    /// Use coarser settings.
    pub(crate) rough: bool,
}

/// Least share of the run over which a reference and its check must agree.
const LEAST_SHARE: f64 = 0.1;

/// Returns the first of `variants` that completes the run, and the remaining ones.
fn first_completed<'a>(
    context: &RunContext<'_>,
    variants: &'a [Variant],
    share: Share,
) -> Result<(Reference, &'a [Variant]), String> {
    let mut why = Vec::new();
    for (n, variant) in variants.iter().enumerate() {
        match context.completed(variant, share.part(variants.len())) {
            Ok(trace) => {
                let reference = Reference {
                    variant: variant.clone(),
                    trace,
                    check: None,
                    until_s: None,
                };
                return Ok((reference, &variants[n + 1..]));
            }
            Err(error) => why.push(format!("{}: {error}", variant.method)),
        }
    }
    if why.is_empty() {
        why.push(String::from("it has no method"));
    }
    Err(why.join("; "))
}

/// Returns the reference of a plant with its check, if there is one, truncated where the two cease
/// to agree.
///
/// # Errors
/// The reasons why no method gives a reference, or the contradiction between the reference and its
/// check.
pub(crate) fn checked(
    context: &RunContext<'_>,
    offer: &PlantOffer,
    scales: Scales,
    trust: Trust,
    share: Share,
) -> Result<Reference, String> {
    let mut variants = trusted(offer, scales);
    if trust.rough {
        for variant in &mut variants {
            variant.setting = variant.setting.relaxed();
        }
    }
    let (mut reference, others) = first_completed(context, &variants, share)?;
    let own_variant = reference.variant.clone();
    let coarser = Variant {
        setting: own_variant.setting.coarser(),
        ..own_variant.clone()
    };
    for variant in others.iter().cloned().chain([coarser]) {
        let Ok(trace) = context.completed(&variant, share.part(others.len() + 1)) else {
            continue;
        };
        let Some(all_errors) = trace.errors(&reference.trace) else {
            continue;
        };
        let until_s = reference.trace.trust_while_near(&trace, trust.apart_m);
        match until_s {
            Some(until_s) if until_s < LEAST_SHARE * context.end.as_secs_f64() => {
                // Two settings of one method only show the magnitude of the unknown error; they
                // cannot contradict each other.
                if variant.method == own_variant.method {
                    reference.trace.trust_all();
                } else {
                    return Err(contradiction(&own_variant, &variant, &all_errors, until_s));
                }
            }
            until_s => reference.until_s = until_s,
        }
        let errors = trace.errors(&reference.trace).unwrap_or(all_errors);
        reference.check = Some((variant, errors));
        break;
    }
    Ok(reference)
}

fn contradiction(reference: &Variant, other: &Variant, apart: &Errors, until_s: f64) -> String {
    format!(
        "{} {} and {} {} contradict each other: they are {} apart, RMS, and agree up to {} only",
        reference.method,
        method_setting(reference.setting.step_s(), reference.setting.tolerance()),
        other.method,
        method_setting(other.setting.step_s(), other.setting.tolerance()),
        si(apart.foot_rms, "m"),
        si(until_s, "s"),
    )
}

impl Reference {
    /// Returns the disagreement of reference and check (RMS); smaller errors are not significant
    /// \[m\].
    pub(crate) fn floor_rms(&self) -> f64 {
        self.check
            .as_ref()
            .map_or(0.0, |(_, errors)| errors.foot_rms)
    }

    pub(crate) fn note(&self) -> ReferenceNote {
        let check = self.check.as_ref().map(|(variant, errors)| CheckNote {
            method: variant.method.clone(),
            step_s: variant.setting.step_s(),
            tolerance: variant.setting.tolerance(),
            independent: variant.method != self.variant.method,
            disagreement_rms_m: errors.foot_rms,
            disagreement_max_m: errors.foot_max,
        });
        let mut why = Vec::new();
        match &check {
            None => why.push("no check run completed".to_owned()),
            Some(check) if !check.independent => {
                why.push("it is checked by its own method, at a coarser setting".to_owned());
            }
            Some(_) => {}
        }
        if let Some(until_s) = self.until_s {
            why.push(format!(
                "it and its check agree up to {}; nothing is compared after that",
                si(until_s, "s")
            ));
        }
        ReferenceNote {
            plant: self.variant.plant.clone(),
            of_plant: None,
            method: Some(self.variant.method.clone()),
            step_s: self.variant.setting.step_s(),
            tolerance: self.variant.setting.tolerance(),
            check,
            holds_until_s: self.until_s,
            why: (!why.is_empty()).then(|| why.join("; ")),
        }
    }

    /// Returns a row with the difference between the model of `other` and that of this reference.
    pub(crate) fn difference(&self, kind: RowKind, other: &Self) -> Row {
        let mut row = Row::new(kind, &other.variant);
        match other.trace.errors(&self.trace) {
            Some(errors) => row.note_errors(&errors),
            None => row = row.ended(Status::Failed, "the plants have no foot in common"),
        }
        row
    }
}

impl Row {
    /// Records the errors of a run.
    pub(crate) fn note_errors(&mut self, errors: &Errors) {
        self.error_rms_m = Some(errors.foot_rms);
        self.error_max_m = Some(errors.foot_max);
        self.foot_to_hip_error_rms_m = errors.foot_to_hip;
        self.trunk_error_rms_m = errors.trunk.map(|(rms, _)| rms);
        self.trunk_error_max_m = errors.trunk.map(|(_, max)| max);
    }
}
