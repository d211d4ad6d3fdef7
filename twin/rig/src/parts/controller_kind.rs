//! Kinds of controllers and the contexts for building them.

use twinrig_document::Range;
use twinrig_robot::Robot;
use twinrig_runtime::{PartKind, Process, ProcessVariable, catch_panic, in_part};
use twinrig_scenario::{Kind, LegFact, OptionSpec, Options, VariableSpec};

use crate::error::{BuildError, NO_ROBOT};

type BuildController =
    Box<dyn Fn(&ControllerContext<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;
type Variables =
    Box<dyn Fn(&ControllerContext<'_>) -> Result<Vec<ProcessVariable>, BuildError> + Send + Sync>;
type BuildOfLegs =
    Box<dyn Fn(&LegContext<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;

/// Context for building a controller.
#[derive(Clone, Copy, Debug)]
pub struct ControllerContext<'a> {
    /// Robot, including overrides of the scenario.
    pub robot: &'a Robot,
    /// Legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// Values of the declared options, from the `[controller]` table of the scenario.
    pub options: &'a Options,
    /// Seed of the run, for named streams ([`twinrig_kernel::stream`]).
    pub seed: u64,
}

/// Context for building a controller without a robot.
#[derive(Clone, Copy, Debug)]
pub struct LegContext<'a> {
    /// Legs of the scene, in the order of the plant.
    pub legs: &'a [LegFact],
    /// Input signals of the plant.
    pub taken: &'a [String],
    /// As in [`ControllerContext`].
    pub options: &'a Options,
    /// As in [`ControllerContext`].
    pub seed: u64,
}

/// Kind of controller.
pub struct ControllerKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    variables: Option<Variables>,
    build: BuildController,
    build_of_legs: Option<BuildOfLegs>,
}

impl ControllerKind {
    /// Creates the kind `name` with the description `about` for `twin list`; `build` builds a
    /// controller. Its process variables must be declared by [`ControllerKind::with_variables`].
    pub fn new<P: Process + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        build: impl Fn(&ControllerContext<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            options: Vec::new(),
            variables: None,
            build: Box::new(move |context| Ok(Box::new(build(context)?))),
            build_of_legs: None,
        }
    }

    /// Declares the process variables, with defaults, for all legs of the robot: they become keys
    /// of the scenario's `[controller]` table.
    #[must_use]
    pub fn with_variables(
        mut self,
        variables: impl Fn(&ControllerContext<'_>) -> Result<Vec<ProcessVariable>, BuildError>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        self.variables = Some(Box::new(variables));
        self
    }

    /// Adds a builder for scenarios without a robot, for standalone plants.
    #[must_use]
    pub fn or_without_robot<P: Process + 'static>(
        mut self,
        build: impl Fn(&LegContext<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        self.build_of_legs = Some(Box::new(move |context| Ok(Box::new(build(context)?))));
        self
    }

    /// Adds an option, a key of the controller table; its value is in
    /// [`ControllerContext::options`].
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }

    /// Returns the scenario keys of the kind for `robot`. Ranges and defaults of process variables
    /// depend on the robot; without a robot there are none.
    pub(crate) fn offer(&self, robot: Option<&Robot>) -> Kind {
        let variables = robot.map_or_else(Vec::new, |robot| {
            let options = Options::defaults(&self.options);
            // A kind that fails here has no variables; the error is reported when it is built.
            catch_panic(|| self.variables(robot, &options))
                .unwrap_or(Ok(Vec::new()))
                .unwrap_or_default()
        });
        let legs = robot.map_or(&[][..], |robot| &robot.legs);
        let spec = |variable: &ProcessVariable| {
            let (min, max) = variable.range();
            let group = variable.name().split_once('/');
            VariableSpec {
                name: variable.name().to_owned(),
                unit: variable.unit(),
                range: Range { min, max },
                default: variable.default(),
                about: String::new(),
                of_leg: group.is_some_and(|(_, group)| legs.iter().any(|leg| leg.name == group)),
            }
        };
        Kind {
            options: self.options.clone(),
            variables: variables.iter().map(spec).collect(),
            ..Kind::new(&self.name, &self.about)
        }
    }

    /// Returns the declared process variables for all legs of `robot`.
    fn variables(
        &self,
        robot: &Robot,
        options: &Options,
    ) -> Result<Vec<ProcessVariable>, BuildError> {
        let Some(variables) = &self.variables else {
            return Ok(Vec::new());
        };
        let legs: Vec<&str> = robot.legs.iter().map(|leg| leg.name.as_str()).collect();
        let context = ControllerContext {
            robot,
            legs: &legs,
            options,
            seed: 1,
        };
        in_part(PartKind::Controller, &self.name, || variables(&context))
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn build(
        &self,
        context: &ControllerContext<'_>,
    ) -> Result<Box<dyn Process>, BuildError> {
        let process = (self.build)(context)?;
        let declared = self.variables(context.robot, context.options)?;
        let is_declared = |variable: &ProcessVariable| {
            let mut same = declared
                .iter()
                .filter(|known| known.name() == variable.name());
            same.any(|known| known.unit() == variable.unit())
        };
        match process.variables().iter().find(|variable| !is_declared(variable)) {
            Some(variable) => Err(format!(
                "it has the process variable `{}` [{}], which its kind does not declare: see `ControllerKind::with_variables`",
                variable.name(),
                variable.unit()
            )
            .into()),
            None => Ok(process),
        }
    }

    /// Builds the controller without a robot.
    pub(crate) fn build_of_legs(
        &self,
        context: &LegContext<'_>,
    ) -> Result<Box<dyn Process>, BuildError> {
        let build = self.build_of_legs.as_ref();
        build.map_or_else(|| Err(NO_ROBOT.into()), |build| build(context))
    }
}
