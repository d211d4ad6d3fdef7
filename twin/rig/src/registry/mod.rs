//! Registry of the kinds of parts of a build.

mod standard;

use std::collections::BTreeSet;

use crate::offer::PlantOffer;
use twinrig_campaign::engine::Engine;
use twinrig_document::DocumentError;
use twinrig_kernel::{Port, SimDuration};
use twinrig_robot::Robot;
use twinrig_runtime::{PartKind, Plant, Process, in_part};
use twinrig_scenario::{Catalogue, Kind, OptionSpec, PlantSpec};

use crate::build_key::BuildKey;
use crate::error::{BuildError, Error};
use crate::parts::accuracy::Accuracy;
use crate::parts::bus_kind::BusKind;
use crate::parts::constraints::CONSTRAINTS;
use crate::parts::context::{ModelContext, PlantContext, StandaloneModel};
use crate::parts::controller_kind::{ControllerContext, ControllerKind, LegContext};
use crate::parts::method::Method;
use crate::parts::plant_kind::PlantKind;

/// Returns the command that a build with the cargo feature `feature` requires first.
pub fn build_needs(feature: &str) -> Option<&'static str> {
    (feature == "mujoco").then_some("ci/setup mujoco")
}

/// Returns the remedy for a part of builds with the cargo feature `feature`.
pub(crate) fn build_remedy(feature: &str) -> String {
    let after = build_needs(feature).map_or_else(String::new, |it| format!(", after `{it}`"));
    format!("build with `--features {feature}`{after}")
}

/// Plants, controllers and buses of a build.
///
/// ```
/// use twinrig_rig::registry::Registry;
///
/// let registry = Registry::standard();
/// assert!(registry.plants().any(|name| name == "massless"));
/// assert!(registry.controllers().any(|name| name == "cpg"));
/// ```
#[derive(Default)]
pub struct Registry {
    plants: Vec<PlantKind>,
    /// Plants that this build lacks.
    missing: Vec<Kind>,
    controllers: Vec<ControllerKind>,
    buses: Vec<BusKind>,
    build: Option<BuildKey>,
    engines: Vec<Box<dyn Engine>>,
    /// Kinds that every build of this crate has: sort of part and name.
    in_every_build: BTreeSet<(PartSort, String)>,
}

/// Sort of a part of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PartSort {
    Plant,
    Controller,
    Bus,
}

impl Registry {
    /// Creates a registry without parts.
    pub fn empty() -> Self {
        Self::default()
    }

    /// Adds a controller, or replaces the one of the same name.
    #[must_use]
    pub fn with_controller(mut self, kind: ControllerKind) -> Self {
        self.controllers.retain(|known| known.name() != kind.name());
        let known = (PartSort::Controller, kind.name().to_owned());
        self.in_every_build.remove(&known);
        self.controllers.push(kind);
        self
    }

    /// Adds a plant, or replaces the one of the same name.
    #[must_use]
    pub fn with_plant(mut self, kind: PlantKind) -> Self {
        self.plants.retain(|known| known.name() != kind.name());
        self.missing.retain(|known| known.name != kind.name());
        let known = (PartSort::Plant, kind.name().to_owned());
        self.in_every_build.remove(&known);
        self.plants.push(kind);
        self
    }

    /// Lists a plant of other programs, with its keys for the schema and the `remedy` for a
    /// scenario that names it.
    #[must_use]
    pub fn without_plant(mut self, kind: Kind, remedy: impl Into<String>) -> Self {
        let remedy = Some(remedy.into());
        self.plants.retain(|known| known.name() != kind.name);
        self.missing.retain(|known| known.name != kind.name);
        self.missing.push(Kind { remedy, ..kind });
        self
    }

    /// Adds a bus, or replaces the one of the same name.
    #[must_use]
    pub fn with_bus(mut self, kind: BusKind) -> Self {
        self.buses.retain(|known| known.name() != kind.name());
        let known = (PartSort::Bus, kind.name().to_owned());
        self.in_every_build.remove(&known);
        self.buses.push(kind);
        self
    }

    /// Declares that every build of this crate has the kinds so far.
    #[must_use]
    pub(crate) fn mark_as_standard(mut self) -> Self {
        let named = |sort, name: &str| (sort, name.to_owned());
        let plants = self.plants().map(|name| named(PartSort::Plant, name));
        let controllers = self
            .controllers()
            .map(|name| named(PartSort::Controller, name));
        let buses = self.buses().map(|name| named(PartSort::Bus, name));
        self.in_every_build = plants.chain(controllers).chain(buses).collect();
        self
    }

    /// Returns whether every build of this crate has that kind: it is neither a custom part nor one
    /// of a cargo feature.
    pub(crate) fn is_in_every_build(&self, sort: PartSort, name: &str) -> bool {
        self.in_every_build.contains(&(sort, name.to_owned()))
    }

    /// Sets the hash of the program that has these parts; without it a sweep takes that of the
    /// file of the running program.
    #[must_use]
    pub fn with_build(mut self, key: BuildKey) -> Self {
        self.build = Some(key);
        self
    }

    /// Adds an engine for sweeps, or replaces the one of the same name. Its workers have to build
    /// the parts of this registry.
    #[must_use]
    pub fn with_engine(mut self, engine: impl Engine + 'static) -> Self {
        self.engines.retain(|known| known.name() != engine.name());
        self.engines.push(Box::new(engine));
        self
    }

    /// Returns the names of the engines besides `local`.
    pub fn engines(&self) -> impl Iterator<Item = &str> {
        self.engines.iter().map(|engine| engine.name())
    }

    /// Returns the engine of that name.
    pub fn engine(&self, name: &str) -> Option<&dyn Engine> {
        let found = self.engines.iter().find(|engine| engine.name() == name);
        found.map(AsRef::as_ref)
    }

    /// Returns the hash of the program.
    ///
    /// # Errors
    /// Its file cannot be read.
    pub fn build(&self) -> Result<BuildKey, Error> {
        self.build.map_or_else(BuildKey::of_program, Ok)
    }

    /// Returns the names of the buses.
    pub fn buses(&self) -> impl Iterator<Item = &str> {
        self.buses.iter().map(BusKind::name)
    }

    /// Returns the bus of that name.
    pub(crate) fn bus(&self, name: &str) -> Option<&BusKind> {
        self.buses.iter().find(|kind| kind.name() == name)
    }

    /// Returns the names of the plants.
    pub fn plants(&self) -> impl Iterator<Item = &str> {
        self.plants.iter().map(PlantKind::name)
    }

    /// Returns the names of the plants that require a robot.
    pub fn plants_on_robots(&self) -> impl Iterator<Item = &str> {
        let plants = self.plants.iter().filter(|kind| !kind.is_standalone());
        plants.map(PlantKind::name)
    }

    /// Returns the names of the controllers.
    pub fn controllers(&self) -> impl Iterator<Item = &str> {
        self.controllers.iter().map(ControllerKind::name)
    }

    /// Returns the JSON schema of the scenarios of this build, with the process variables of its
    /// controllers on any of `robots`, for completion in editors.
    ///
    /// ```
    /// use twinrig_rig::registry::Registry;
    /// use twinrig_robot::RobotFile;
    ///
    /// let robot = RobotFile::find("oncilla", "".as_ref())?.robot()?;
    /// let schema = Registry::standard().schema(&[robot]);
    /// assert_eq!(schema["required"][1], "plant");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn schema(&self, robots: &[Robot]) -> serde_json::Value {
        let mut catalogue = self.catalogue(None);
        for robot in robots {
            let kinds = self.controllers.iter().map(|kind| kind.offer(Some(robot)));
            for (kind, on_robot) in catalogue.controllers.iter_mut().zip(kinds) {
                kind.unite_variables(on_robot.variables);
            }
        }
        twinrig_scenario::schema(&catalogue)
    }

    fn controller_kind(&self, name: &str) -> Option<&ControllerKind> {
        self.controllers.iter().find(|kind| kind.name() == name)
    }

    fn plant_kind(&self, name: &str) -> Option<&PlantKind> {
        self.plants.iter().find(|kind| kind.name() == name)
    }

    /// Builds the controller `name`; `None` for an unknown name.
    pub(crate) fn controller(
        &self,
        name: &str,
        given: &ControllerContext<'_>,
    ) -> Option<Result<Box<dyn Process>, BuildError>> {
        let kind = self.controller_kind(name)?;
        Some(in_part(PartKind::Controller, name, || kind.build(given)))
    }

    /// Builds the controller `name` for a standalone plant.
    pub(crate) fn controller_of_legs(
        &self,
        name: &str,
        given: &LegContext<'_>,
    ) -> Option<Result<Box<dyn Process>, BuildError>> {
        let kind = self.controller_kind(name)?;
        Some(in_part(PartKind::Controller, name, || {
            kind.build_of_legs(given)
        }))
    }

    /// Loads the standalone model of a plant; `None` for a plant on a robot and for an unknown
    /// name.
    pub(crate) fn standalone_model(
        &self,
        context: &ModelContext<'_>,
    ) -> Option<Result<Box<dyn StandaloneModel>, DocumentError>> {
        let name = &context.plant.model;
        let kind = self.plant_kind(name)?;
        in_part(PartKind::Plant, name, || kind.load(context))
    }

    /// Returns the ports of the plant of `context`, all outputs included; `None` for an unknown
    /// name.
    pub(crate) fn plant_ports(
        &self,
        context: &PlantContext<'_>,
    ) -> Option<Result<Vec<Port>, BuildError>> {
        let name = &context.plant.model;
        let kind = self.plant_kind(name)?;
        Some(in_part(PartKind::Plant, name, || kind.ports(context)))
    }

    /// Builds the plant of `context`; `None` for an unknown name.
    pub(crate) fn plant(
        &self,
        context: &PlantContext<'_>,
    ) -> Option<Result<Box<dyn Plant>, BuildError>> {
        let name = &context.plant.model;
        let kind = self.plant_kind(name)?;
        Some(in_part(PartKind::Plant, name, || kind.build(context)))
    }

    /// Returns the plant `name` for studies, once for each formulation of its constraints, with its
    /// methods; none for an unknown name.
    pub fn offers(&self, name: &str) -> Vec<(PlantOffer, Vec<Method>)> {
        self.plant_kind(name).map_or(Vec::new(), PlantKind::offers)
    }

    /// Returns the options of the plant `name`; none for an unknown name.
    pub fn plant_options(&self, name: &str) -> Vec<OptionSpec> {
        let kind = self.plant_kind(name).map(PlantKind::kind);
        kind.map_or(Vec::new(), |kind| kind.options)
    }

    /// Returns whether the constraints of the plant `name` can be rigid or compliant.
    pub(crate) fn has_constraints(&self, name: &str) -> bool {
        let kind = self.plant_kind(name).map(PlantKind::kind);
        kind.is_some_and(|kind| kind.options.iter().any(|it| it.name == CONSTRAINTS))
    }

    /// Returns the step of a plant: of the scenario, otherwise of its kind, if it has one.
    pub fn plant_step(&self, plant: &PlantSpec) -> Option<SimDuration> {
        let kind = self.plant_kind(&plant.model)?;
        plant.step.or(kind.step())
    }

    /// Returns the settings of the numerical error of a plant on a robot.
    pub(crate) fn accuracy(&self, plant: &PlantSpec) -> Accuracy {
        let kind = self.plant_kind(&plant.model);
        kind.map_or(Accuracy::Unknown, |kind| kind.accuracy(plant))
    }

    /// Returns the keys of scenarios for `robot`. Ranges and defaults of process variables depend
    /// on the robot; without one there are none.
    pub fn catalogue(&self, robot: Option<&Robot>) -> Catalogue {
        let plants = self.plants.iter().map(PlantKind::kind);
        let controllers = self.controllers.iter().map(|kind| kind.offer(robot));
        let buses = self.buses.iter().map(BusKind::offer);
        Catalogue {
            plants: plants.chain(self.missing.iter().cloned()).collect(),
            controllers: controllers.collect(),
            buses: buses.collect(),
        }
    }
}
