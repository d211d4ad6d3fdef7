//! What kinds of plants are made of.

use std::path::Path;

use twinrig_document::DocumentError;
use twinrig_kernel::{Direction, Port, SimDuration};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_scenario::{ActuatorSpec, Kind, LegFact, OptionSpec, PlantSpec};
use twinrig_study::PlantOffer;

use crate::error::BuildError;
use crate::parts::drives::abduction_ports;
use crate::parts::method::Method;
use crate::parts::setup::legged_ports;

type BuildPlant =
    Box<dyn Fn(&PlantContext<'_>) -> Result<Box<dyn Plant>, BuildError> + Send + Sync>;
type PlantPorts = Box<dyn Fn(&PlantContext<'_>) -> Result<Vec<Port>, BuildError> + Send + Sync>;
type LoadModel =
    Box<dyn Fn(&ModelContext<'_>) -> Result<Box<dyn StandaloneModel>, DocumentError> + Send + Sync>;

/// What a plant is built from.
#[derive(Clone, Copy)]
pub struct PlantContext<'a> {
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

/// What a plant that stands alone makes its model from.
#[derive(Clone, Copy, Debug)]
pub struct ModelContext<'a> {
    /// The scenario's `[plant]` table.
    pub plant: &'a PlantSpec,
    /// The folder that paths are seen from.
    pub folder: &'a Path,
    /// The files of [`StandaloneModel::files`] that a recording kept, if this is the run of a recording: then nothing else is there.
    pub kept: Option<&'a [(String, Vec<u8>)]>,
}

/// The model that a plant brings along instead of standing on a robot file: what a scenario needs to know of it.
pub trait StandaloneModel: Send + Sync {
    /// What it is called, for a person.
    fn name(&self) -> &str;

    /// Its legs, as the names of its signals have them (`leg/LF/…`).
    fn legs(&self) -> Vec<LegFact>;

    /// Its weight \[N\].
    fn weight(&self) -> f64;

    /// Its ports, all outputs included.
    fn ports(&self) -> Vec<Port>;

    /// The names of its inputs.
    fn inputs(&self) -> Vec<String> {
        let ports = self.ports().into_iter();
        let inputs = ports.filter(|port| port.direction == Direction::Input);
        inputs.map(|port| port.name).collect()
    }

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

/// A kind of plant.
pub struct PlantKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    step: Option<SimDuration>,
    methods: Vec<Method>,
    segment_masses: bool,
    model_of: Option<String>,
    ports: PlantPorts,
    build: Build,
}

/// What a plant stands on.
enum Build {
    OnRobot(BuildPlant),
    Alone(LoadModel),
}

impl PlantKind {
    /// A kind that scenarios call `name`; `about` is its line in `twin list`; `build` builds a plant. Its ports are those of
    /// a legged robot, unless [`PlantKind::with_ports`] declares others.
    pub fn new<P: Plant + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        build: impl Fn(&PlantContext<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        let build: BuildPlant = Box::new(move |context| Ok(Box::new(build(context)?)));
        Self::of(name.into(), about.into(), Build::OnRobot(build))
    }

    /// A kind that stands alone: `load` makes the model that it brings along, and says at which place of the scenario
    /// something is wrong with it. A scenario with it needs no robot.
    pub fn standalone<M: StandaloneModel + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        load: impl Fn(&ModelContext<'_>) -> Result<M, DocumentError> + Send + Sync + 'static,
    ) -> Self {
        let load: LoadModel = Box::new(move |context| Ok(Box::new(load(context)?)));
        Self::of(name.into(), about.into(), Build::Alone(load))
    }

    fn of(name: String, about: String, build: Build) -> Self {
        Self {
            name,
            about,
            options: Vec::new(),
            step: None,
            methods: Vec::new(),
            segment_masses: true,
            model_of: None,
            ports: Box::new(legged_ports),
            build,
        }
    }

    /// Whether it brings its own model instead of standing on a robot.
    pub(crate) fn is_standalone(&self) -> bool {
        matches!(self.build, Build::Alone(_))
    }

    /// Declares the ports of the plant, all outputs included: those of which a built plant has the inputs, and the outputs
    /// that are requested.
    #[must_use]
    pub fn with_ports(
        mut self,
        ports: impl Fn(&PlantContext<'_>) -> Result<Vec<Port>, BuildError> + Send + Sync + 'static,
    ) -> Self {
        self.ports = Box::new(ports);
        self
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

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The step where a scenario gives none, if it has one.
    pub(crate) fn step(&self) -> Option<SimDuration> {
        self.step
    }

    /// What scenarios may say of it.
    pub(crate) fn kind(&self) -> Kind {
        Kind {
            options: self.options.clone(),
            is_standalone: self.is_standalone(),
            ..Kind::new(&self.name, &self.about)
        }
    }

    /// What studies can do with it.
    pub(crate) fn offer(&self) -> (PlantOffer, Vec<Method>) {
        let methods = match &self.methods[..] {
            [] => vec![Method::stepped("its own", "the only method of this plant")],
            methods => methods.to_vec(),
        };
        let offer = PlantOffer {
            name: self.name.clone(),
            about: self.about.clone(),
            segment_masses: self.segment_masses,
            model_of: self.model_of.clone(),
            methods: methods.iter().map(Method::offer).collect(),
        };
        (offer, methods)
    }

    /// Makes the model that it brings along; none if it stands on a robot.
    pub(crate) fn load(
        &self,
        context: &ModelContext<'_>,
    ) -> Option<Result<Box<dyn StandaloneModel>, DocumentError>> {
        match &self.build {
            Build::OnRobot(_) => None,
            Build::Alone(load) => Some(load(context)),
        }
    }

    /// Its ports in the scene of `context`, all outputs included.
    pub(crate) fn ports(&self, context: &PlantContext<'_>) -> Result<Vec<Port>, BuildError> {
        Ok([(self.ports)(context)?, abduction_ports(context)].concat())
    }

    pub(crate) fn build(&self, context: &PlantContext<'_>) -> Result<Box<dyn Plant>, BuildError> {
        match &self.build {
            Build::OnRobot(build) => {
                let plant = build(context)?;
                check_ports(&plant.ports(), &(self.ports)(context)?, context.wanted)?;
                Ok(plant)
            }
            Build::Alone(_) => Err("it stands alone, on no robot".into()),
        }
    }
}

/// Checks the ports of a built plant against the declared ones: the inputs, and the outputs that are requested.
fn check_ports(
    built: &[Port],
    declared: &[Port],
    wanted: &dyn Fn(&str) -> bool,
) -> Result<(), BuildError> {
    let required = |port: &&Port| port.direction == Direction::Input || wanted(&port.name);
    let undeclared = built.iter().find(|port| !declared.contains(port));
    let missing = declared
        .iter()
        .filter(required)
        .find(|port| !built.contains(port));
    let (port, what) = match (undeclared, missing) {
        (Some(port), _) => (port, "has the undeclared port"),
        (None, Some(port)) => (port, "lacks the declared port"),
        (None, None) => return Ok(()),
    };
    let (name, size, unit) = (&port.name, port.size, port.unit);
    Err(format!("it {what} `{name}` ({size} × {unit}); see `PlantKind::with_ports`").into())
}
