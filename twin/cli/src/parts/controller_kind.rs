//! What kinds of controllers are made of.

use twinrig_document::Range;
use twinrig_robot::Robot;
use twinrig_runtime::{PartKind, Process, ProcessVariable, caught, in_part};
use twinrig_scenario::{Kind, LegFact, OptionSpec, Options, VariableSpec};

use crate::error::{BuildError, NO_ROBOT};

type BuildController =
    Box<dyn Fn(&ControllerContext<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;
type Variables =
    Box<dyn Fn(&ControllerContext<'_>) -> Result<Vec<ProcessVariable>, BuildError> + Send + Sync>;
type BuildOfLegs =
    Box<dyn Fn(&LegContext<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;

/// What a controller is built from.
#[derive(Clone, Copy, Debug)]
pub struct ControllerContext<'a> {
    /// The robot, with what the scenario overrides.
    pub robot: &'a Robot,
    /// The legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// The options that the kind declares, as the scenario's `[controller]` table has them.
    pub options: &'a Options,
    /// Seed of the run, for named streams ([`twinrig_kernel::stream`]).
    pub seed: u64,
}

/// What a controller is built from that needs no robot.
#[derive(Clone, Copy, Debug)]
pub struct LegContext<'a> {
    /// The legs of the scene, in the order of the plant.
    pub legs: &'a [LegFact],
    /// The signals that the plant takes.
    pub taken: &'a [String],
    /// As in [`ControllerContext`].
    pub options: &'a Options,
    /// As in [`ControllerContext`].
    pub seed: u64,
}

/// A kind of controller.
pub struct ControllerKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    variables: Option<Variables>,
    build: BuildController,
    build_of_legs: Option<BuildOfLegs>,
}

impl ControllerKind {
    /// A kind that scenarios call `name`; `about` is its line in `twin list`; `build` builds a controller, whose process
    /// variables [`ControllerKind::with_variables`] declares.
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
            build: Box::new(move |given| Ok(Box::new(build(given)?))),
            build_of_legs: None,
        }
    }

    /// Declares the process variables, with defaults, for all legs of the robot: they become keys of the scenario's
    /// `[controller]` table.
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

    /// Can be built without a robot, too, for a plant that stands alone.
    #[must_use]
    pub fn or_without_robot<P: Process + 'static>(
        mut self,
        build: impl Fn(&LegContext<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
    ) -> Self {
        self.build_of_legs = Some(Box::new(move |given| Ok(Box::new(build(given)?))));
        self
    }

    /// Accepts another key in its table, which [`ControllerContext::options`] brings.
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }

    /// Keys of scenarios for `robot`. Ranges and defaults of process variables depend on the robot; without one there are
    /// none.
    pub(crate) fn offer(&self, robot: Option<&Robot>) -> Kind {
        let variables = robot.map_or_else(Vec::new, |robot| {
            let options = Options::defaults(&self.options);
            // A kind that fails here offers no variables; a scenario that names it learns the reason when it is built.
            caught(|| self.variables(robot, &options))
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

    /// The declared process variables for all legs of `robot`.
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
        given: &ControllerContext<'_>,
    ) -> Result<Box<dyn Process>, BuildError> {
        let process = (self.build)(given)?;
        let declared = self.variables(given.robot, given.options)?;
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

    /// The same without a robot.
    pub(crate) fn build_of_legs(
        &self,
        given: &LegContext<'_>,
    ) -> Result<Box<dyn Process>, BuildError> {
        let build = self.build_of_legs.as_ref();
        build.map_or_else(|| Err(NO_ROBOT.into()), |build| build(given))
    }
}
