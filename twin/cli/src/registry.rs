//! What a build is made of.

use std::path::Path;

use twinrig_document::{DocumentError, Range};
use twinrig_kernel::SimDuration;
use twinrig_robot::Robot;
use twinrig_runtime::{Plant, Process};
use twinrig_scenario::{
    ActuatorSpec, Catalogue, Kind, LegFact, OptionSpec, Options, PlantSpec, VariableSpec,
};
use twinrig_study::PlantOffer;

use crate::bus_kind::BusKind;
use crate::method::Method;
use crate::standard;

/// Why a part could not be built; `?` makes one of any error.
pub type BuildError = Box<dyn std::error::Error + Send + Sync>;

type BuildController =
    Box<dyn Fn(&Given<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;
type BuildOfLegs =
    Box<dyn Fn(&GivenLegs<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;
type BuildPlant = Box<dyn Fn(&Physics<'_>) -> Result<Box<dyn Plant>, BuildError> + Send + Sync>;
type LoadModel =
    Box<dyn Fn(&Bringing<'_>) -> Result<Box<dyn OwnModel>, DocumentError> + Send + Sync>;

/// Why a part cannot be built that stands on a robot.
pub(crate) const NO_ROBOT: &str = "it needs a robot, and the scenario names none: add `robot = …`, or take a part that needs none";

/// What a controller is built from.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a> {
    /// The robot, with what the scenario overrides.
    pub robot: &'a Robot,
    /// The legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// The options that the kind declares, as the scenario's `[controller]` table has them.
    pub options: &'a Options,
    /// Seed of the run, for named streams ([`twinrig_kernel::stream`]).
    pub seed: u64,
}

/// What a plant is built from.
#[derive(Clone, Copy)]
pub struct Physics<'a> {
    /// The robot, with what the scenario overrides.
    pub robot: &'a Robot,
    /// The legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// The scenario's `[plant]` table.
    pub plant: &'a PlantSpec,
    /// The scenario's `[actuator]` table.
    pub actuator: &'a ActuatorSpec,
    /// The signals that the controller commands first, by name: a vector's elements each have its name.
    pub first_commands: &'a [(String, f64)],
    /// Time between two commands.
    pub command_period: SimDuration,
    /// Seed of the run.
    pub seed: u64,
    /// Whether somebody wants the signal of that name; what nobody wants need not be computed.
    pub wanted: &'a dyn Fn(&str) -> bool,
}

/// What a controller is built from that needs no robot.
#[derive(Clone, Copy, Debug)]
pub struct GivenLegs<'a> {
    /// The legs of the scene, in the order of the plant.
    pub legs: &'a [LegFact],
    /// The signals that the plant takes.
    pub taken: &'a [String],
    /// As in [`Given`].
    pub options: &'a Options,
    /// As in [`Given`].
    pub seed: u64,
}

/// What a plant that stands alone makes its model from.
#[derive(Clone, Copy, Debug)]
pub struct Bringing<'a> {
    /// The scenario's `[plant]` table.
    pub plant: &'a PlantSpec,
    /// The folder that paths are seen from.
    pub folder: &'a Path,
    /// The files of [`OwnModel::files`] that a recording kept, if this is the run of a recording: then nothing else is there.
    pub kept: Option<&'a [(String, Vec<u8>)]>,
}

/// The model that a plant brings along instead of standing on a robot file: what a scenario needs to know of it.
pub trait OwnModel: Send + Sync {
    /// What it is called, for a person.
    fn name(&self) -> &str;

    /// Its legs, as the names of its signals have them (`leg/LF/…`).
    fn legs(&self) -> Vec<LegFact>;

    /// Its weight \[N\].
    fn weight(&self) -> f64;

    /// The signals that drive it.
    fn inputs(&self) -> Vec<String>;

    /// The step that it is simulated in where a scenario says none; none if it has none.
    fn step(&self) -> Option<SimDuration>;

    /// What a recording must keep for it to be run again, by name.
    fn files(&self) -> Vec<(String, Vec<u8>)>;

    /// Builds the plant, which computes the outputs that are wanted.
    ///
    /// # Errors
    /// It refuses what the scenario says.
    fn build(
        &self,
        plant: &PlantSpec,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError>;
}

/// A kind of controller.
pub struct ControllerKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    build: BuildController,
    build_of_legs: Option<BuildOfLegs>,
}

/// A kind of plant.
pub struct PlantKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    step: Option<SimDuration>,
    methods: Vec<Method>,
    segment_masses: bool,
    model_of: Option<String>,
    build: BuildOfPlant,
}

/// What a plant stands on.
enum BuildOfPlant {
    Robot(BuildPlant),
    Nothing(LoadModel),
}

/// The command without which a build with the cargo feature `feature` fails, if there is one.
pub(crate) fn build_needs(feature: &str) -> Option<&'static str> {
    (feature == "mujoco").then_some("ci/setup mujoco")
}

/// The plants, controllers and buses of a build.
///
/// ```
/// use twinrig::Registry;
///
/// let registry = Registry::standard();
/// assert!(registry.plants().any(|name| name == "massless"));
/// assert!(registry.controllers().any(|name| name == "cpg"));
/// ```
#[derive(Default)]
pub struct Registry {
    plants: Vec<PlantKind>,
    /// Plants that this build does not have.
    missing: Vec<Kind>,
    controllers: Vec<ControllerKind>,
    buses: Vec<BusKind>,
}

impl ControllerKind {
    /// A kind that scenarios call `name`; `about` is a line for `twin list`; `build` makes one.
    ///
    /// Its process variables need no mention: they are asked of the process, and become keys of the scenario's
    /// `[controller]` table by themselves.
    pub fn new<P: Process + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        build: impl Fn(&Given<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            options: Vec::new(),
            build: Box::new(move |given| Ok(Box::new(build(given)?))),
            build_of_legs: None,
        }
    }

    /// Can be built without a robot, too, for a plant that stands alone.
    #[must_use]
    pub fn or_without_robot<P: Process + 'static>(
        mut self,
        build: impl Fn(&GivenLegs<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        self.build_of_legs = Some(Box::new(move |given| Ok(Box::new(build(given)?))));
        self
    }

    /// Accepts another key in its table, which [`Given::options`] brings.
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }
}

impl PlantKind {
    /// A kind that scenarios call `name`; `about` is a line for `twin list`; `build` makes one.
    pub fn new<P: Plant + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        build: impl Fn(&Physics<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            options: Vec::new(),
            step: None,
            methods: Vec::new(),
            segment_masses: true,
            model_of: None,
            build: BuildOfPlant::Robot(Box::new(move |physics| Ok(Box::new(build(physics)?)))),
        }
    }

    /// A kind that stands alone: `load` makes the model that it brings along, and says at which place of the scenario
    /// something is wrong with it. A scenario with it needs no robot.
    pub fn alone<M: OwnModel + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        load: impl Fn(&Bringing<'_>) -> Result<M, DocumentError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            options: Vec::new(),
            step: None,
            methods: Vec::new(),
            segment_masses: true,
            model_of: None,
            build: BuildOfPlant::Nothing(Box::new(move |bringing| Ok(Box::new(load(bringing)?)))),
        }
    }

    fn stands_alone(&self) -> bool {
        matches!(self.build, BuildOfPlant::Nothing(_))
    }

    /// Accepts another key in its table, which [`PlantSpec::options`] brings.
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }

    /// Steps by `step` where a scenario gives none: for `twin plan` to show.
    #[must_use]
    pub fn with_step(mut self, step: SimDuration) -> Self {
        self.step = Some(step);
        self
    }

    /// Can be integrated by `method`: for studies, which try them all. One that declares none has one, with its step.
    #[must_use]
    pub fn with_method(mut self, method: Method) -> Self {
        self.methods.push(method);
        self
    }

    /// The segments of its legs have no mass: studies then compare it with plants whose segments lose theirs.
    #[must_use]
    pub fn without_segment_masses(mut self) -> Self {
        self.segment_masses = false;
        self
    }

    /// Solves the model of the plant `name` by other means: studies then measure it against the reference of that one.
    #[must_use]
    pub fn with_model_of(mut self, name: &str) -> Self {
        self.model_of = Some(name.to_owned());
        self
    }
}

impl Registry {
    /// Nothing at all.
    pub fn empty() -> Self {
        Self::default()
    }

    /// Everything that comes with this crate.
    pub fn standard() -> Self {
        standard::registry()
    }

    /// Adds a controller; one of the same name is replaced.
    #[must_use]
    pub fn with_controller(mut self, kind: ControllerKind) -> Self {
        self.controllers.retain(|known| known.name != kind.name);
        self.controllers.push(kind);
        self
    }

    /// Adds a plant; one of the same name is replaced.
    #[must_use]
    pub fn with_plant(mut self, kind: PlantKind) -> Self {
        self.plants.retain(|known| known.name != kind.name);
        self.missing.retain(|known| known.name != kind.name);
        self.plants.push(kind);
        self
    }

    /// Lists a plant that a build with the cargo feature `feature` would have.
    #[must_use]
    pub fn without_plant(self, name: &str, about: &str, feature: &str) -> Self {
        self.without(Kind::new(name, about), feature)
    }

    /// The same with what a scenario can say of it, for the schema.
    #[must_use]
    pub fn without(mut self, kind: Kind, feature: &str) -> Self {
        self.missing.push(Kind {
            missing_feature: Some(feature.to_owned()),
            build_needs: build_needs(feature).map(str::to_owned),
            ..kind
        });
        self
    }

    /// Adds a bus; one of the same name is replaced.
    #[must_use]
    pub fn with_bus(mut self, kind: BusKind) -> Self {
        self.buses.retain(|known| known.name() != kind.name());
        self.buses.push(kind);
        self
    }

    /// The names of its buses.
    pub fn buses(&self) -> impl Iterator<Item = &str> {
        self.buses.iter().map(BusKind::name)
    }

    /// The bus of that name.
    pub(crate) fn bus(&self, name: &str) -> Option<&BusKind> {
        self.buses.iter().find(|kind| kind.name() == name)
    }

    /// The names of its plants.
    pub fn plants(&self) -> impl Iterator<Item = &str> {
        self.plants.iter().map(|kind| kind.name.as_str())
    }

    /// The names of those of its plants that stand on a robot.
    pub(crate) fn plants_on_robots(&self) -> impl Iterator<Item = &str> {
        let plants = self.plants.iter().filter(|kind| !kind.stands_alone());
        plants.map(|kind| kind.name.as_str())
    }

    /// The names of its controllers.
    pub fn controllers(&self) -> impl Iterator<Item = &str> {
        self.controllers.iter().map(|kind| kind.name.as_str())
    }

    /// The JSON schema of the scenarios that this build can run, with the process variables that its controllers have on
    /// `robot`. Editors complete keys with it.
    pub fn schema(&self, robot: &Robot) -> serde_json::Value {
        twinrig_scenario::schema(&self.catalogue(Some(robot)))
    }

    /// Builds the controller `name`; none if there is no such controller.
    pub(crate) fn controller(
        &self,
        name: &str,
        given: &Given<'_>,
    ) -> Option<Result<Box<dyn Process>, BuildError>> {
        let kind = self.controllers.iter().find(|kind| kind.name == name)?;
        Some((kind.build)(given))
    }

    /// The same without a robot.
    pub(crate) fn controller_of_legs(
        &self,
        name: &str,
        given: &GivenLegs<'_>,
    ) -> Option<Result<Box<dyn Process>, BuildError>> {
        let kind = self.controllers.iter().find(|kind| kind.name == name)?;
        let Some(build) = &kind.build_of_legs else {
            return Some(Err(NO_ROBOT.into()));
        };
        Some(build(given))
    }

    /// Makes the model that the plant brings along; none if it stands on a robot, or there is no such plant.
    pub(crate) fn own_model(
        &self,
        bringing: &Bringing<'_>,
    ) -> Option<Result<Box<dyn OwnModel>, DocumentError>> {
        let name = &bringing.plant.model;
        let kind = self.plants.iter().find(|kind| kind.name == *name)?;
        match &kind.build {
            BuildOfPlant::Robot(_) => None,
            BuildOfPlant::Nothing(load) => Some(load(bringing)),
        }
    }

    /// Builds the plant of `physics`; none if there is no such plant.
    pub(crate) fn plant(
        &self,
        physics: &Physics<'_>,
    ) -> Option<Result<Box<dyn Plant>, BuildError>> {
        let name = &physics.plant.model;
        let kind = self.plants.iter().find(|kind| kind.name == *name)?;
        Some(match &kind.build {
            BuildOfPlant::Robot(build) => build(physics),
            BuildOfPlant::Nothing(_) => Err("it stands alone, on no robot".into()),
        })
    }

    /// What studies can do with the plant `name`; none if there is no such plant.
    pub(crate) fn offer(&self, name: &str) -> Option<(PlantOffer, Vec<Method>)> {
        let kind = self.plants.iter().find(|kind| kind.name == name)?;
        let methods = match &kind.methods[..] {
            [] => vec![Method::stepped("its own", "the only method of this plant")],
            methods => methods.to_vec(),
        };
        let offer = PlantOffer {
            name: kind.name.clone(),
            about: kind.about.clone(),
            segment_masses: kind.segment_masses,
            model_of: kind.model_of.clone(),
            methods: methods.iter().map(Method::offer).collect(),
        };
        Some((offer, methods))
    }

    /// The step of a plant: the scenario's, or else that of its kind, if it has one.
    pub(crate) fn plant_step(&self, plant: &PlantSpec) -> Option<SimDuration> {
        let kind = self.plants.iter().find(|kind| kind.name == plant.model)?;
        plant.step.or(kind.step)
    }

    /// What scenarios for `robot` may say. Ranges and defaults of process variables depend on the robot; without one, the
    /// kinds have none.
    pub(crate) fn catalogue(&self, robot: Option<&Robot>) -> Catalogue {
        let plants = self.plants.iter().map(|kind| Kind {
            options: kind.options.clone(),
            stands_alone: kind.stands_alone(),
            ..Kind::new(&kind.name, &kind.about)
        });
        let controllers = self.controllers.iter().map(|kind| Kind {
            options: kind.options.clone(),
            variables: robot.map_or_else(Vec::new, |robot| variables(kind, robot)),
            ..Kind::new(&kind.name, &kind.about)
        });
        let buses = self.buses.iter().map(BusKind::offer);
        Catalogue {
            plants: plants.chain(self.missing.iter().cloned()).collect(),
            controllers: controllers.collect(),
            buses: buses.collect(),
        }
    }
}

/// The process variables of a controller for all legs of `robot`. One that cannot be built without a scenario has none
/// here, and none can be set.
fn variables(kind: &ControllerKind, robot: &Robot) -> Vec<VariableSpec> {
    let legs: Vec<&str> = robot.legs.iter().map(|leg| leg.name.as_str()).collect();
    let options = Options::defaults(&kind.options);
    let given = Given {
        robot,
        legs: &legs,
        options: &options,
        seed: 1,
    };
    let Ok(process) = (kind.build)(&given) else {
        return Vec::new();
    };
    let spec = |variable: &twinrig_runtime::ProcessVariable| {
        let (min, max) = variable.range();
        VariableSpec {
            name: variable.name().to_owned(),
            unit: variable.unit(),
            range: Range { min, max },
            default: variable.default(),
            about: String::new(),
        }
    };
    process.variables().iter().map(spec).collect()
}
