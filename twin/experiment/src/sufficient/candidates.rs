//! Candidates of the search of the cheapest sufficient twin, from what the registry declares for
//! studies.

use std::path::Path;

use twinrig_document::quoted;
use twinrig_kernel::SimDuration;
use twinrig_rig::PlantId;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::parts::constraints::CONSTRAINTS;
use twinrig_rig::parts::method::Method;
use twinrig_rig::registry::Registry;
use twinrig_rig::{MethodSetting, PlantOffer, SettingKind};
use twinrig_scenario::{OptionSpec, Setting};

use crate::error::Error;
use crate::plants::selection::{PlantUnderStudy, Selection};
use crate::{Candidate, CandidateReference, PrecisionPlan};

const STANDALONE: &str = "its plant has a model of its own";
const STANDALONE_HELP: &str = "name a scenario whose plant is built from a robot file";
/// Times that the settings of a reference are relaxed if it takes too long.
const RELAXED: usize = 2;

/// Candidates of a scenario.
pub(super) struct Candidates {
    pub(super) own: Candidate,
    pub(super) refinements: Vec<Vec<Candidate>>,
    pub(super) references: Vec<CandidateReference>,
    /// Plants and methods that are no candidates, with the reasons.
    pub(super) left_out: Vec<String>,
    /// Labels of plants whose legs are without segment masses.
    pub(super) massless: Vec<String>,
}

/// Plant that a search may use.
type Offered<'s, 'r> = (&'s PlantOffer, &'s PlantUnderStudy<'r>);

impl Candidates {
    /// Returns the candidates of the scenario of `own`, of the plants called `names` or of all.
    pub(super) fn of(
        registry: &Registry,
        path: &Path,
        settings: &[Setting],
        names: &[String],
        own: &Assembly<'_>,
    ) -> Result<Self, Error> {
        let scenario = own.scenario();
        if scenario.plant.is_standalone {
            return Err(Error::NoSufficiency {
                file: scenario.file.clone(),
                why: STANDALONE.to_owned(),
                help: STANDALONE_HELP.to_owned(),
            });
        }
        let mut selection = Selection::default();
        for name in names {
            // A plant that is asked for must suit the scenario; one that is not may not.
            Selection::default().add(registry, path, settings, name, true, scenario)?;
        }
        let plants: Vec<&str> = registry.plants_on_robots().collect();
        for name in plants {
            selection.add(registry, path, settings, name, false, scenario)?;
        }
        let mut left_out = std::mem::take(&mut selection.left_out);
        let is_named = |name: &str| names.is_empty() || names.iter().any(|named| named == name);
        left_out.retain(|line| is_named(line.split([':', ',', ' ']).next().unwrap_or_default()));
        let offered: Vec<Offered<'_, '_>> =
            selection.offers.iter().zip(&selection.benches).collect();
        let mut builder = CandidateBuilder {
            registry,
            own,
            left_out,
        };
        let references = builder.references(&offered);
        let mut order: Vec<&Offered<'_, '_>> = offered.iter().collect();
        // Plants without segment masses are cheap, engines expensive.
        order.sort_by_key(|(offer, _)| (offer.segment_masses, offer.model_of.is_some()));
        let searched = order.into_iter();
        let searched = searched.filter(|(offer, _)| is_named(&offer.plant.name));
        let refinements = searched.flat_map(|offered| builder.refinements(offered));
        let refinements = refinements.collect();
        let massless = selection.offers.iter();
        let massless = massless.filter(|offer| !offer.segment_masses);
        Ok(Self {
            own: Candidate {
                plant: builder.own_plant(),
                method: None,
                setting: None,
                settings: Vec::new(),
            },
            refinements,
            references,
            left_out: builder.left_out,
            massless: massless.map(|offer| offer.plant.name.clone()).collect(),
        })
    }
}

/// Writes candidates in words of the scenario language.
struct CandidateBuilder<'a> {
    registry: &'a Registry,
    own: &'a Assembly<'a>,
    left_out: Vec<String>,
}

impl CandidateBuilder<'_> {
    fn own_plant(&self) -> PlantId {
        let plant = PlantId::new(&self.own.scenario().plant.model);
        match self.own.constraints() {
            Some(constraints) => plant.with_constraints(constraints),
            None => plant,
        }
    }

    /// Returns the longest step that a plant is asked for.
    fn step_most(&self) -> SimDuration {
        let observed = self.own.scenario().observe.period;
        match self.own.scenario().controller {
            Some(_) => observed.min(self.own.period()),
            None => observed,
        }
    }

    /// Returns the settings of a method that a scenario can have, from the coarsest to the finest
    /// of a study of precision.
    fn refinements(&mut self, (offer, bench): &Offered<'_, '_>) -> Vec<Vec<Candidate>> {
        let plan = PrecisionPlan::default();
        let mut refinements = Vec::new();
        for method in &bench.methods {
            let offered = method.offer();
            if offered.step_only {
                continue;
            }
            let settings: Vec<MethodSetting> = match offered.set_by {
                // Observations and commands divide longer steps.
                SettingKind::Step => {
                    let steps = plan.steps.iter().filter(|&&step| step <= self.step_most());
                    steps.map(|&step| MethodSetting::Step(step)).collect()
                }
                SettingKind::Tolerance => {
                    let tolerances = plan.tolerances.iter();
                    tolerances.map(|&it| MethodSetting::Tolerance(it)).collect()
                }
            };
            let candidates = settings.into_iter();
            let candidates = candidates.map(|setting| self.candidate(offer, method, setting));
            match candidates.collect::<Result<Vec<_>, String>>() {
                Ok(candidates) => refinements.push(candidates),
                Err(why) => {
                    let set_by = match offered.set_by {
                        SettingKind::Step => "fixed steps",
                        SettingKind::Tolerance => "error control",
                    };
                    let line = format!("{} {}, {set_by}: {why}", offer.plant, offered.name);
                    self.left_out.push(line);
                }
            }
        }
        refinements
    }

    /// Returns the references: the first plant with masses in its segments, with the constraints
    /// that the scenario has for it, by its trusted methods.
    fn references(&self, offered: &[Offered<'_, '_>]) -> Vec<CandidateReference> {
        let is_of_scenario = |(offer, bench): &&Offered<'_, '_>| {
            let assembly = (*bench.assembly).as_ref();
            let constraints = assembly.ok().and_then(Assembly::constraints);
            offer.plant.constraints.as_deref() == constraints
        };
        let own = offered.iter().filter(is_of_scenario);
        let complete = own.clone().find(|(offer, _)| offer.segment_masses);
        let Some((offer, bench)) = complete.or_else(|| own.clone().next()) else {
            return Vec::new();
        };
        let trusted = bench.methods.iter().filter_map(|method| {
            let setting = method.offer().reference?;
            let candidate = self.candidate(offer, method, setting).ok()?;
            Some((candidate, method, setting))
        });
        let mut trusted = trusted;
        let Some((mut reference, method, mut setting)) = trusted.next() else {
            return Vec::new();
        };
        let mut other = trusted.next().map(|(_, method, setting)| (method, setting));
        let mut references = Vec::new();
        for _ in 0..=RELAXED {
            let (by, at) = other.unwrap_or((method, setting.coarser()));
            if let Ok(check) = self.candidate(offer, by, at) {
                references.push(CandidateReference { reference, check });
            }
            setting = setting.relaxed();
            other = other.map(|(method, setting)| (method, setting.relaxed()));
            match self.candidate(offer, method, setting) {
                Ok(relaxed) => reference = relaxed,
                Err(_) => break,
            }
        }
        references
    }

    /// Returns the candidate with a method at a setting.
    ///
    /// # Errors
    /// The reason why no scenario can have it.
    fn candidate(
        &self,
        offer: &PlantOffer,
        method: &Method,
        setting: MethodSetting,
    ) -> Result<Candidate, String> {
        let name = &offer.plant.name;
        let specs: Vec<OptionSpec> = self.registry.plant_options(name);
        let mut settings = vec![["plant.model".to_owned(), quoted(name)]];
        let of_plant = method.settings(&specs, setting)?.into_iter();
        settings.extend(of_plant.map(|[key, value]| [format!("plant.{key}"), value]));
        // Constraints that a scenario names change the course of its set-points, which is no part
        // of the choice.
        let actuator = &self.own.scenario().actuator;
        let names_constraints = settings
            .iter()
            .any(|[key, _]| *key == format!("plant.{CONSTRAINTS}"));
        if let (Some(course), true) = (
            actuator.set_point,
            names_constraints && actuator.kind.has_set_points(),
        ) {
            settings.push(["actuator.set_point".to_owned(), quoted(course.name())]);
        }
        Ok(Candidate {
            plant: offer.plant.clone(),
            method: Some(method.offer().name),
            setting: Some(setting),
            settings,
        })
    }
}
