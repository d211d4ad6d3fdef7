//! Kinds of plants.

use crate::offer::PlantOffer;
use crate::plant_id::PlantId;
use twinrig_document::DocumentError;
use twinrig_kernel::{Direction, Port, SimDuration};
use twinrig_legged::Constraints;
use twinrig_runtime::Plant;
use twinrig_scenario::{Kind, OptionSpec, Options, PlantSpec, Standalone};

use crate::error::BuildError;
use crate::parts::abduction::abduction_ports;
use crate::parts::accuracy::Accuracy;
use crate::parts::context::{ModelContext, PlantContext, StandaloneModel};
use crate::parts::method::Method;
use crate::parts::setup::legged_ports;

type BuildPlant =
    Box<dyn Fn(&PlantContext<'_>) -> Result<Box<dyn Plant>, BuildError> + Send + Sync>;
type PlantPorts = Box<dyn Fn(&PlantContext<'_>) -> Result<Vec<Port>, BuildError> + Send + Sync>;
type LoadModel =
    Box<dyn Fn(&ModelContext<'_>) -> Result<Box<dyn StandaloneModel>, DocumentError> + Send + Sync>;

/// Name of the formulation of an engine's soft constraints, for studies.
pub const SOFT: &str = "soft";

/// Kind of plant.
pub struct PlantKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    step: Option<SimDuration>,
    tolerance: fn(&Options) -> Option<f64>,
    is_exact: bool,
    methods: Vec<Method>,
    compliant_methods: Vec<Method>,
    soft_methods: Vec<Method>,
    segment_masses: bool,
    model_of: Option<String>,
    /// Of a standalone plant.
    standalone: Standalone,
    takes_pushes: bool,
    ports: PlantPorts,
    build: Build,
}

/// Builder of a plant.
enum Build {
    /// From a robot file.
    OnRobot(BuildPlant),
    /// From a separate model.
    Standalone(LoadModel),
}

impl PlantKind {
    /// Creates the kind `name` with the description `about` for `twin list`; `build` builds a
    /// plant. Its ports are those of a legged robot, unless [`PlantKind::with_ports`] declares
    /// others.
    pub fn new<P: Plant + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        build: impl Fn(&PlantContext<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        let build: BuildPlant = Box::new(move |context| Ok(Box::new(build(context)?)));
        Self::of(name.into(), about.into(), Build::OnRobot(build))
    }

    /// Creates the kind `name` of a plant with a separate model: `load` loads the model and reports
    /// errors at their places in the scenario. A scenario with such a plant needs no robot.
    pub fn standalone<M: StandaloneModel + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        load: impl Fn(&ModelContext<'_>) -> Result<M, DocumentError> + Send + Sync + 'static,
    ) -> Self {
        let load: LoadModel = Box::new(move |context| Ok(Box::new(load(context)?)));
        Self::of(name.into(), about.into(), Build::Standalone(load))
    }

    fn of(name: String, about: String, build: Build) -> Self {
        Self {
            name,
            about,
            options: Vec::new(),
            step: None,
            tolerance: |_| None,
            is_exact: false,
            methods: Vec::new(),
            compliant_methods: Vec::new(),
            soft_methods: Vec::new(),
            segment_masses: true,
            model_of: None,
            standalone: Standalone::default(),
            takes_pushes: false,
            ports: Box::new(legged_ports),
            build,
        }
    }

    /// Returns whether the plant has a separate model instead of a robot file.
    pub(crate) fn is_standalone(&self) -> bool {
        matches!(self.build, Build::Standalone(_))
    }

    /// Declares the ports of the plant, including all outputs. A built plant has all of the inputs,
    /// and the requested outputs.
    #[must_use]
    pub fn with_ports(
        mut self,
        ports: impl Fn(&PlantContext<'_>) -> Result<Vec<Port>, BuildError> + Send + Sync + 'static,
    ) -> Self {
        self.ports = Box::new(ports);
        self
    }

    /// Adds an option, a key of the plant table; its value is in
    /// [`PlantSpec::options`](twinrig_scenario::PlantSpec::options).
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }

    /// Declares that the standalone plant can take the place of a plant on a robot: base, legs,
    /// ground, start and actuators of a scenario are accepted. Ground and legs serve the judge; the
    /// rest has no effect.
    #[must_use]
    pub fn with_robot_keys(mut self) -> Self {
        self.standalone.takes_robot_keys = true;
        self
    }

    /// Declares that the standalone plant applies [`ModelContext::overrides`] to its file.
    #[must_use]
    pub fn with_overrides(mut self) -> Self {
        self.standalone.is_overridable = true;
        self
    }

    /// Declares that the plant applies [`PlantContext::pushes`].
    #[must_use]
    pub fn with_pushes(mut self) -> Self {
        self.takes_pushes = true;
        self
    }

    /// Declares the default step, for `twin plan`.
    #[must_use]
    pub fn with_step(mut self, step: SimDuration) -> Self {
        self.step = Some(step);
        self
    }

    /// Declares the tolerance of the error control under the options of a scenario; none of a
    /// method without one.
    #[must_use]
    pub fn with_tolerance(mut self, tolerance: fn(&Options) -> Option<f64>) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Declares that the plant evaluates closed forms: it has no numerical error.
    #[must_use]
    pub fn exact(mut self) -> Self {
        self.is_exact = true;
        self
    }

    /// Adds an integration method, for studies. A kind without declared methods has one, which is
    /// set by its step.
    #[must_use]
    pub fn with_method(mut self, method: Method) -> Self {
        self.methods.push(method);
        self
    }

    /// Adds an integration method for compliant constraints, for studies: they then offer the plant
    /// once with rigid constraints, by its other methods, and once with compliant ones.
    #[must_use]
    pub fn with_compliant_method(mut self, method: Method) -> Self {
        self.compliant_methods.push(method);
        self
    }

    /// Adds an integration method for an engine's soft constraints, for studies of gaits: they then
    /// offer the plant once more, as a model of its own whose errors are compared with those of
    /// compliant constraints.
    #[must_use]
    pub fn with_soft_method(mut self, method: Method) -> Self {
        self.soft_methods.push(method);
        self
    }

    /// Declares that the leg segments have no mass: studies compare the plant with other plants in
    /// the limit of vanishing segment masses.
    #[must_use]
    pub fn without_segment_masses(mut self) -> Self {
        self.segment_masses = false;
        self
    }

    /// Declares that the plant solves the same model as the plant `name`, whose reference studies
    /// then use.
    #[must_use]
    pub fn with_model_of(mut self, name: &str) -> Self {
        self.model_of = Some(name.to_owned());
        self
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Returns the declared default step.
    pub(crate) fn step(&self) -> Option<SimDuration> {
        self.step
    }

    /// Returns the settings of the numerical error of a plant on a robot.
    pub(crate) fn accuracy(&self, plant: &PlantSpec) -> Accuracy {
        match plant.step.or(self.step) {
            _ if self.is_exact => Accuracy::Exact,
            Some(step) => Accuracy::Set {
                step,
                tolerance: (self.tolerance)(&plant.options),
            },
            None => Accuracy::Unknown,
        }
    }

    /// Returns the scenario keys of the kind.
    pub(crate) fn kind(&self) -> Kind {
        Kind {
            options: self.options.clone(),
            standalone: self.is_standalone().then_some(self.standalone),
            takes_pushes: self.takes_pushes,
            ..Kind::new(&self.name, &self.about)
        }
    }

    /// Returns the descriptions of the plant for studies, one for each formulation of its
    /// constraints, and the methods of each.
    pub(crate) fn offers(&self) -> Vec<(PlantOffer, Vec<Method>)> {
        let methods = match &self.methods[..] {
            [] => vec![Method::stepped("its own", "the only method of this plant")],
            methods => methods.to_vec(),
        };
        if self.compliant_methods.is_empty() {
            let mut offers = vec![self.offer(PlantId::new(&self.name), methods)];
            if !self.soft_methods.is_empty() {
                let plant = PlantId::new(&self.name).with_constraints(SOFT);
                let (offer, methods) = self.offer(plant, self.soft_methods.clone());
                let offer = PlantOffer {
                    model_of: None,
                    peer: self.model_of.as_ref().map(|model| {
                        let model = PlantId::new(model);
                        model
                            .with_constraints(Constraints::Compliant.name())
                            .label()
                    }),
                    ..offer
                };
                offers.push((offer, methods));
            }
            return offers;
        }
        let formulations = [
            (Constraints::Rigid, methods),
            (Constraints::Compliant, self.compliant_methods.clone()),
        ];
        let offers = formulations.map(|(constraints, methods)| {
            let methods = methods.into_iter();
            let methods = methods.map(|method| method.with_constraints(constraints));
            let plant = PlantId::new(&self.name).with_constraints(constraints.name());
            self.offer(plant, methods.collect())
        });
        offers.into()
    }

    fn offer(&self, plant: PlantId, methods: Vec<Method>) -> (PlantOffer, Vec<Method>) {
        let offer = PlantOffer {
            plant,
            about: self.about.clone(),
            segment_masses: self.segment_masses,
            model_of: self.model_of.clone(),
            peer: None,
            methods: methods.iter().map(Method::offer).collect(),
        };
        (offer, methods)
    }

    /// Loads the separate model; none if the plant is based on a robot file.
    pub(crate) fn load(
        &self,
        context: &ModelContext<'_>,
    ) -> Option<Result<Box<dyn StandaloneModel>, DocumentError>> {
        match &self.build {
            Build::OnRobot(_) => None,
            Build::Standalone(load) => Some(load(context)),
        }
    }

    /// Returns the ports for the scene of `context`, including all outputs.
    pub(crate) fn ports(&self, context: &PlantContext<'_>) -> Result<Vec<Port>, BuildError> {
        Ok([(self.ports)(context)?, abduction_ports(context)].concat())
    }

    pub(crate) fn build(&self, context: &PlantContext<'_>) -> Result<Box<dyn Plant>, BuildError> {
        match &self.build {
            Build::OnRobot(_) if !context.pushes.is_empty() && !self.takes_pushes => {
                Err("it takes no pushes; leave them out, or take another plant".into())
            }
            Build::OnRobot(build) => {
                let plant = build(context)?;
                check_ports(&plant.ports(), &(self.ports)(context)?, context.wanted)?;
                Ok(plant)
            }
            Build::Standalone(_) => Err("it has its own model and uses no robot".into()),
        }
    }
}

/// Checks the ports of a built plant against the declared ones: the inputs, and the outputs that
/// are requested.
fn check_ports(
    built: &[Port],
    declared: &[Port],
    requested: &dyn Fn(&str) -> bool,
) -> Result<(), BuildError> {
    let required = |port: &&Port| port.direction == Direction::Input || requested(&port.name);
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
