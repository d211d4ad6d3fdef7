//! What a plant is measured against, and how far that is to be trusted.

use serde::Serialize;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{PartKind, Plant, in_part};

use crate::budget::Share;
use crate::factory::{MethodSetting, PlantFactory, PlantOffer, Scales, SetBy, Variant};
use crate::number::{instant, method_setting, si};
use crate::panics::Panics;
use crate::plant_run::{Ending, PlantRun};
use crate::row::{Row, RowKind, Status};
use crate::trace::{Errors, Trace};

/// Where a method says nothing, its finest setting is this.
const FINEST_STEP: SimDuration = SimDuration::from_micros(5);
const FINEST_TOLERANCE: f64 = 1e-12;

/// A run that others of the same plant are measured against.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    pub(crate) variant: Variant,
    pub(crate) trace: Trace,
    /// Another method, or the same at a coarser setting, and how far it is from this as long as they agree.
    pub(crate) check: Option<(Variant, Errors)>,
    /// The time up to which they do, if it is not the end of the scene \[s\].
    pub(crate) until_s: Option<f64>,
}

/// A reference, as a study tells of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceNote {
    /// Its plant.
    pub plant: String,
    /// The plant that the reference is a run of, where that is another one of the same model.
    pub of_plant: Option<String>,
    /// Its method; none if there is no reference.
    pub method: Option<String>,
    /// Its step \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// What it was checked by.
    pub check: Option<CheckNote>,
    /// It and its check agree up to this time, and nothing is compared after it; none: to the end \[s\].
    pub holds_until_s: Option<f64>,
    /// Why there is none, or no check.
    pub why: Option<String>,
}

/// The check of a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckNote {
    /// Its method.
    pub method: String,
    /// Its step \[s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_s: Option<f64>,
    /// Its tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Whether it is another method.
    pub independent: bool,
    /// Root of the mean square distance between the two \[m\].
    pub disagreement_rms_m: f64,
    /// The greatest distance between the two \[m\].
    pub disagreement_max_m: f64,
}

/// A scene without its plant.
#[derive(Clone, Copy)]
pub(crate) struct Stage<'a> {
    pub(crate) factory: &'a dyn PlantFactory,
    pub(crate) end: SimTime,
    pub(crate) grid: SimDuration,
    pub(crate) panics: &'a Panics,
}

impl Stage<'_> {
    /// Builds a variant and leads it through the scene.
    ///
    /// # Errors
    /// Why it could not be built.
    pub(crate) fn record(
        &self,
        variant: &Variant,
        share: Share,
        enough: impl FnMut(f64) -> bool,
    ) -> Result<(Trace, Ending), String> {
        let plant_run = self.plant_run(share);
        self.with_plant(variant, |plant| Trace::record(plant, &plant_run, enough))
    }

    /// Builds a variant and does `what` with it.
    ///
    /// # Errors
    /// Why it could not be built, or how it panicked.
    pub(crate) fn with_plant<R>(
        &self,
        variant: &Variant,
        what: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        self.with_built(variant, |factory| factory.build(variant), what)
    }

    /// The same with a plant that tells of its drives.
    pub(crate) fn with_drives<R>(
        &self,
        variant: &Variant,
        what: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        self.with_built(variant, |factory| factory.build_with_drives(variant), what)
    }

    fn with_built<R>(
        &self,
        variant: &Variant,
        build: impl FnOnce(&dyn PlantFactory) -> Result<Box<dyn Plant>, String>,
        what: impl FnOnce(&mut dyn Plant) -> R,
    ) -> Result<R, String> {
        self.panics.guarded(|| {
            in_part(PartKind::Plant, &variant.plant, || {
                let mut plant = build(self.factory)?;
                Ok(what(&mut *plant))
            })
        })
    }

    pub(crate) fn plant_run(&self, share: Share) -> PlantRun<'_> {
        PlantRun {
            commands: &self.factory.scene().commands,
            end: self.end,
            grid: self.grid,
            deadline: share.deadline,
        }
    }

    /// The trace of a variant that came to the end of the scene.
    fn whole(&self, variant: &Variant, share: Share) -> Result<Trace, String> {
        let (trace, ending) = self.record(variant, share, |_| false)?;
        match ended(&ending, share) {
            None => Ok(trace),
            Some((_, why)) => Err(why),
        }
    }
}

/// What a run that ended so is, if it did not come to its end.
pub(crate) fn ended(ending: &Ending, share: Share) -> Option<(Status, String)> {
    match ending {
        Ending::Whole | Ending::Enough(_) => None,
        Ending::Fault(fault) => Some((Status::Failed, fault.to_string())),
        Ending::NotFinite(at) => Some((
            Status::Unstable,
            format!("something is no longer a number at {}", instant(*at)),
        )),
        Ending::TooSlow(at) => Some((
            Status::Failed,
            format!(
                "too slow: at {} after {:.1} s, its budget",
                instant(*at),
                share.seconds
            ),
        )),
    }
}

/// The settings at which methods of `offer` are trusted, the best first.
fn trusted(offer: &PlantOffer, scales: Scales) -> Vec<Variant> {
    let variant = |method: &str, setting| Variant {
        plant: offer.name.clone(),
        method: method.to_owned(),
        setting,
        scales,
    };
    let named = offer.methods.iter().filter_map(|method| {
        let setting = method.reference?;
        Some(variant(&method.name, setting))
    });
    let others = offer
        .methods
        .iter()
        .filter(|method| method.reference.is_none());
    let others = others.map(|method| {
        let setting = match method.set_by {
            SetBy::Step => MethodSetting::Step(FINEST_STEP),
            SetBy::Tolerance => MethodSetting::Tolerance(FINEST_TOLERANCE),
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

/// How closely a reference and its check have to agree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trust {
    /// Where they are further apart, neither is one \[m\].
    pub(crate) apart_m: f64,
    /// Coarser settings are good enough.
    pub(crate) rough: bool,
}

/// Where a reference and its check agree for less than this share of the scene, there is none.
const LEAST_SHARE: f64 = 0.1;

/// The first of `variants` that comes to the end, and those after it.
fn first_whole<'a>(
    stage: &Stage<'_>,
    variants: &'a [Variant],
    share: Share,
) -> Result<(Reference, &'a [Variant]), String> {
    let mut why = Vec::new();
    for (n, variant) in variants.iter().enumerate() {
        match stage.whole(variant, share.part(variants.len())) {
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

/// A reference with its check, where there is one, and no further than the two agree.
///
/// # Errors
/// Why none of the methods gives one, or that its check contradicts it.
pub(crate) fn checked(
    stage: &Stage<'_>,
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
    let (mut reference, others) = first_whole(stage, &variants, share)?;
    let own = reference.variant.clone();
    let coarser = Variant {
        setting: own.setting.coarser(),
        ..own.clone()
    };
    for variant in others.iter().cloned().chain([coarser]) {
        let Ok(trace) = stage.whole(&variant, share.part(others.len() + 1)) else {
            continue;
        };
        let Some(whole) = trace.errors(&reference.trace) else {
            continue;
        };
        let until_s = reference.trace.trust_while_near(&trace, trust.apart_m);
        match until_s {
            Some(until_s) if until_s < LEAST_SHARE * stage.end.as_secs_f64() => {
                // A method does not contradict itself: its two settings only tell how much is not known.
                if variant.method == own.method {
                    reference.trace.trust_all();
                } else {
                    return Err(contradiction(&own, &variant, &whole, until_s));
                }
            }
            until_s => reference.until_s = until_s,
        }
        let errors = trace.errors(&reference.trace).unwrap_or(whole);
        reference.check = Some((variant, errors));
        break;
    }
    Ok(reference)
}

fn contradiction(own: &Variant, other: &Variant, apart: &Errors, until_s: f64) -> String {
    format!(
        "{} {} and {} {} contradict each other: they are {} apart, RMS, and agree up to {} only",
        own.method,
        method_setting(own.setting.step_s(), own.setting.tolerance()),
        other.method,
        method_setting(other.setting.step_s(), other.setting.tolerance()),
        si(apart.foot_rms, "m"),
        si(until_s, "s"),
    )
}

impl Reference {
    /// What is not known of it: errors below are none \[m\].
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
            None => why.push("nothing came to the end that could check it".to_owned()),
            Some(check) if !check.independent => {
                why.push("it is checked by its own method, at a coarser setting".to_owned());
            }
            Some(_) => {}
        }
        if let Some(until_s) = self.until_s {
            why.push(format!(
                "its check leaves it after {}: nothing is compared from there on",
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

    /// A row on the difference between the model of `other` and that of this.
    pub(crate) fn difference(&self, kind: RowKind, other: &Self) -> Row {
        let mut row = Row::new(kind, &other.variant);
        match other.trace.errors(&self.trace) {
            Some(errors) => row.note_errors(&errors),
            None => row = row.ended(Status::Failed, "the plants have no foot in common"),
        }
        row
    }
}

impl ReferenceNote {
    /// That `plant` has none.
    pub(crate) fn missing(plant: &str, why: String) -> Self {
        Self {
            plant: plant.to_owned(),
            of_plant: None,
            method: None,
            step_s: None,
            tolerance: None,
            check: None,
            holds_until_s: None,
            why: Some(why),
        }
    }
}

impl Row {
    /// Notes how far a run is from where it should be.
    pub(crate) fn note_errors(&mut self, errors: &Errors) {
        self.error_rms_m = Some(errors.foot_rms);
        self.error_max_m = Some(errors.foot_max);
        self.trunk_error_rms_m = errors.trunk.map(|(rms, _)| rms);
        self.trunk_error_max_m = errors.trunk.map(|(_, max)| max);
    }
}
