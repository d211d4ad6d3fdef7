//! What kinds of controllers are made of.

use twinrig_document::Range;
use twinrig_robot::Robot;
use twinrig_runtime::{PartKind, Process, ProcessVariable, caught, in_part};
use twinrig_scenario::{Kind, LegFact, OptionSpec, Options, VariableSpec};

use crate::error::{BuildError, NO_ROBOT};

type BuildController =
    Box<dyn Fn(&ControllerContext<'_>) -> Result<Box<dyn Process>, BuildError> + Send + Sync>;
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
    build: BuildController,
    build_of_legs: Option<BuildOfLegs>,
}

impl ControllerKind {
    /// A kind that scenarios call `name`; `about` is a line for `twin list`; `build` makes one.
    ///
    /// Its process variables need no mention: they are asked of the process, and become keys of the scenario's
    /// `[controller]` table by themselves.
    pub fn new<P: Process + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        build: impl Fn(&ControllerContext<'_>) -> Result<P, BuildError> + Send + Sync + 'static,
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

    /// What scenarios for `robot` may say of it. Ranges and defaults of process variables depend on the robot; without one, it
    /// has none.
    pub(crate) fn offer(&self, robot: Option<&Robot>) -> Kind {
        Kind {
            options: self.options.clone(),
            // Of one that panics nothing is known; scenarios of others have nothing to do with that.
            variables: robot.map_or_else(Vec::new, |robot| {
                caught(|| self.variables(robot)).unwrap_or_default()
            }),
            ..Kind::new(&self.name, &self.about)
        }
    }

    /// Its process variables for all legs of `robot`. One that cannot be built without a scenario has none here, and none can
    /// be set.
    pub(crate) fn variables(&self, robot: &Robot) -> Vec<VariableSpec> {
        let legs: Vec<&str> = robot.legs.iter().map(|leg| leg.name.as_str()).collect();
        let options = Options::defaults(&self.options);
        let given = ControllerContext {
            robot,
            legs: &legs,
            options: &options,
            seed: 1,
        };
        let built = in_part(PartKind::Controller, &self.name, || (self.build)(&given));
        let Ok(process) = built else {
            return Vec::new();
        };
        let spec = |variable: &ProcessVariable| {
            let (min, max) = variable.range();
            let group = variable.name().split_once('/');
            VariableSpec {
                name: variable.name().to_owned(),
                unit: variable.unit(),
                range: Range { min, max },
                default: variable.default(),
                about: String::new(),
                of_leg: group.is_some_and(|(_, group)| legs.contains(&group)),
            }
        };
        process.variables().iter().map(spec).collect()
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn build(
        &self,
        given: &ControllerContext<'_>,
    ) -> Result<Box<dyn Process>, BuildError> {
        (self.build)(given)
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
