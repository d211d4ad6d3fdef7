//! Kinds of parts that the runs of a sweep use.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use twinrig_rig::registry::Registry;
use twinrig_scenario::{Kind, Scenario};

/// Remedy where a build has no better one.
const HELP: &str = "prepare all machines of the cluster as the head";

/// Kind of parts that a registry lacks.
pub(crate) struct MissingPart {
    pub(crate) sort: &'static str,
    pub(crate) name: String,
    pub(crate) help: String,
}

/// Names of the kinds, by sort.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct UsedParts {
    plants: BTreeSet<String>,
    controllers: BTreeSet<String>,
    buses: BTreeSet<String>,
}

impl UsedParts {
    /// Returns those of a scenario.
    pub(crate) fn of(scenario: &Scenario) -> Self {
        let mut parts = Self::default();
        parts.add(scenario);
        parts
    }

    /// Adds those of a scenario.
    pub(crate) fn add(&mut self, scenario: &Scenario) {
        self.plants.insert(scenario.plant.model.clone());
        let controller = scenario.controller.iter().map(|it| it.kind.clone());
        self.controllers.extend(controller);
        self.buses
            .extend(scenario.buses.iter().map(|bus| bus.kind.clone()));
    }

    /// Returns the first kind that the registry lacks. It may be that of the same build, as kinds
    /// also depend on packages of a machine.
    pub(crate) fn first_missing(&self, registry: &Registry) -> Option<MissingPart> {
        let catalogue = registry.catalogue(None);
        let missing = |names: &BTreeSet<String>, kinds: &[Kind]| {
            names.iter().find_map(|name| {
                let known = kinds.iter().find(|kind| kind.name == *name);
                match known.map(|kind| kind.remedy.clone()) {
                    Some(None) => None,
                    Some(Some(remedy)) => Some((name.clone(), remedy)),
                    None => Some((name.clone(), HELP.to_owned())),
                }
            })
        };
        let plant = missing(&self.plants, &catalogue.plants).map(|it| ("plant", it));
        let plant = plant.or_else(|| {
            missing(&self.controllers, &catalogue.controllers).map(|it| ("controller", it))
        });
        let first = plant.or_else(|| missing(&self.buses, &catalogue.buses).map(|it| ("bus", it)));
        first.map(|(sort, (name, help))| MissingPart { sort, name, help })
    }
}
