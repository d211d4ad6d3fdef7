//! From a scenario file to a rig.

pub(crate) mod body;
pub(crate) mod buses;
pub(crate) mod registry;
pub(crate) mod sources;

use std::path::{Path, PathBuf};

use twinrig_document::Document;
use twinrig_kernel::{Direction, Field, Layout, Port, SimDuration, SimTime};
use twinrig_robot::Robot;
use twinrig_runtime::{
    Change, PartKind, Plant, Process, Rig, RigError, Schedule, Timing, WiringError, in_part,
};
use twinrig_scenario::{ActuatorSpec, Facts, GroundBelow, PlantSpec, Scenario, Scene, Setting};

use crate::assembly::body::Body;
use crate::assembly::registry::Registry;
use crate::assembly::sources::{SCENARIO_FILE, Sources};
use crate::error::NO_ROBOT;
use crate::error::TwinError;
use crate::parts::controller_kind::{ControllerContext, LegContext};
use crate::parts::coupling;
use crate::parts::drives::with_abduction;
use crate::parts::idle::Idle;
use crate::parts::plant_kind::{PlantContext, StandaloneModel};
use crate::parts::setup::ground_below;
use crate::run::recording_size;

/// The signals that poses are drawn from.
const FRAME_SIGNALS: [&str; 3] = ["body/position", "body/orientation", "leg/*/angles"];

/// A scenario that has become a scene, with everything it takes to build its rig as often as one likes.
///
/// ```no_run
/// use std::path::Path;
/// use twinrig::{Assembly, Registry};
/// use twinrig::kernel::{SimDuration, SimTime};
///
/// let registry = Registry::standard();
/// let assembly = Assembly::of_file(&registry, Path::new("scenarios/trot.toml"), &[])?;
/// let mut rig = assembly.rig()?;
/// rig.run_until(SimTime::ZERO + SimDuration::from_secs(1), &mut ())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Assembly<'r> {
    pub(crate) registry: &'r Registry,
    scene: Scene,
    body: Body,
    plant_outputs: Vec<Port>,
    diagnostics: Vec<Port>,
}

impl<'r> Assembly<'r> {
    /// Of the scenario in the file at `path`, with `settings` on top.
    ///
    /// # Errors
    /// Whatever is wrong with the scenario, its robot, or the parts that they ask for.
    pub fn of_file(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
    ) -> Result<Self, TwinError> {
        let sources = Sources {
            document: Document::read(path)?,
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            robot: None,
            kept: None,
        };
        Self::new(registry, &sources, settings)
    }

    /// Of texts, as a recording keeps them.
    ///
    /// # Errors
    /// As [`Assembly::of_file`].
    pub fn of_texts(
        registry: &'r Registry,
        scenario: &str,
        robot: &str,
        settings: &[Setting],
    ) -> Result<Self, TwinError> {
        Self::of_kept(registry, scenario, Some(robot), Vec::new(), settings)
    }

    /// Of texts and of the files of a plant that stands alone.
    pub(crate) fn of_kept(
        registry: &'r Registry,
        scenario: &str,
        robot: Option<&str>,
        kept: Vec<(String, Vec<u8>)>,
        settings: &[Setting],
    ) -> Result<Self, TwinError> {
        let sources = Sources {
            document: Document::parse(SCENARIO_FILE, scenario)?,
            folder: PathBuf::new(),
            robot: robot.map(str::to_owned),
            kept: Some(kept),
        };
        Self::new(registry, &sources, settings)
    }

    fn new(
        registry: &'r Registry,
        sources: &Sources,
        settings: &[Setting],
    ) -> Result<Self, TwinError> {
        let (scenario, file) = sources.read(registry, settings)?;
        let body = Body::of(registry, &scenario, file.as_ref(), sources.kept.as_deref())?;
        let legs = scenario.legs(&body.legs())?;
        let mut assembly = Self {
            registry,
            // Nothing is left out until it is known what there is.
            scene: Scene {
                weight: body.weight(),
                wanted: Vec::new(),
                recorded: Vec::new(),
                left_out: Vec::new(),
                scenario,
                legs,
                ground: GroundBelow::Nothing,
            },
            body,
            plant_outputs: Vec::new(),
            diagnostics: Vec::new(),
        };
        assembly.check_fault_places()?;
        let plant_outputs = outputs(&*assembly.plant(&|_| true)?);
        let process_ports = process_ports(&*assembly.process()?);
        let facts = Facts {
            legs: assembly.scene.legs.clone(),
            weight: assembly.scene.weight,
            measured: assembly.measured(&plant_outputs),
            diagnostics: assembly.diagnostics_of(&process_ports)?,
            plant_outputs,
            process_ports,
            frame_signals: FRAME_SIGNALS.map(str::to_owned).into(),
            ground: assembly.ground_below()?,
        };
        assembly.scene = assembly.scene.scenario.scene(&facts)?;
        let large =
            recording_size::warning(&assembly.scene, &facts.plant_outputs, &facts.process_ports);
        assembly.scene.scenario.warnings.extend(large);
        assembly.plant_outputs = facts.plant_outputs;
        assembly.diagnostics = facts.diagnostics;
        Ok(assembly)
    }

    fn ground_below(&self) -> Result<GroundBelow, TwinError> {
        let scenario = self.scenario();
        let ground = ground_below(&scenario.plant, scenario.seed);
        ground.map_err(|source| self.not_built("plant", &scenario.plant.model, source))
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scene.scenario
    }

    /// The robot, with what the scenario overrides; none where the plant stands alone and the scenario names none.
    pub fn robot(&self) -> Option<&Robot> {
        self.body.robot()
    }

    /// The robot file: its name and its text.
    pub fn robot_file(&self) -> Option<(&str, &str)> {
        self.body.robot_file()
    }

    /// What is simulated, before anything is left out.
    pub(crate) fn body(&self) -> &Body {
        &self.body
    }

    /// What drivers and boards count.
    pub fn diagnostics(&self) -> &[Port] {
        &self.diagnostics
    }

    /// Every output that the plant could give, wanted or not.
    pub fn plant_outputs(&self) -> &[Port] {
        &self.plant_outputs
    }

    /// The same without changes and expectations: the run that others are measured against.
    #[must_use]
    pub fn without_changes(&self) -> Self {
        Self {
            registry: self.registry,
            scene: Scene {
                scenario: self.scene.scenario.without_changes(),
                ..self.scene.clone()
            },
            body: self.body.clone(),
            plant_outputs: self.plant_outputs.clone(),
            diagnostics: self.diagnostics.clone(),
        }
    }

    /// Builds the parts, wires them and schedules the changes.
    ///
    /// # Errors
    /// A part that cannot be built, or signals that do not connect.
    pub fn rig(&self) -> Result<Rig, TwinError> {
        self.rig_around(|plant| plant)
    }

    /// The same with something around the plant.
    pub(crate) fn rig_around(
        &self,
        around: impl FnOnce(Box<dyn Plant>) -> Box<dyn Plant>,
    ) -> Result<Rig, TwinError> {
        let plant = around(self.wanted_plant()?);
        let process = self.process()?;
        let tasks = self.tasks(&process_ports(&*process))?;
        let schedule = self.schedule();
        let mut rig =
            Rig::new(&schedule, process, tasks, plant).map_err(|error| self.rig_error(error))?;
        for (at, variable, change) in self.changes() {
            rig.schedule(at, variable, change)
                .map_err(|error| self.rig_error(error))?;
        }
        Ok(rig)
    }

    /// What is to become of process variables, and when.
    pub(crate) fn changes(&self) -> impl Iterator<Item = (SimTime, &str, Change)> {
        let changes = self.scenario().changes.iter();
        changes.map(|change| (change.at, change.variable.as_str(), change.change))
    }

    /// When the rig does what.
    pub fn schedule(&self) -> Schedule {
        let scenario = self.scenario();
        let step = scenario.io.step;
        Schedule {
            step,
            every: self.period().as_nanos() / step.as_nanos().max(1),
            observe: scenario.observe.period,
            compute: scenario
                .controller
                .as_ref()
                .map_or(Timing::ZERO, |spec| spec.compute_time.clone()),
            seed: scenario.seed,
            ..Schedule::with_period(step)
        }
    }

    /// The control period.
    pub fn period(&self) -> SimDuration {
        let scenario = self.scenario();
        let controller = scenario.controller.as_ref();
        controller.map_or(scenario.io.step, |spec| spec.period)
    }

    /// The end of the run.
    pub fn end(&self) -> SimTime {
        self.scenario().end()
    }

    pub(crate) fn leg_names(&self) -> Vec<&str> {
        self.scene
            .legs
            .iter()
            .map(|leg| leg.name.as_str())
            .collect()
    }

    /// The plant, which computes what somebody wants of it, coupled as the scenario says.
    pub(crate) fn wanted_plant(&self) -> Result<Box<dyn Plant>, TwinError> {
        let wanted = |name: &str| self.scene.wanted.iter().any(|other| other == name);
        let spec = &self.scenario().plant;
        let plant = self.plant(&|name| coupling::needs(spec.coupling, name, &wanted))?;
        coupling::coupled(spec.coupling, plant, &wanted)
            .map_err(|source| self.not_built("plant", &spec.model, source))
    }

    fn plant(&self, wanted: &dyn Fn(&str) -> bool) -> Result<Box<dyn Plant>, TwinError> {
        let scenario = self.scenario();
        let spec = &scenario.plant;
        if let Some(model) = self.body.standalone_model() {
            let built = model.build(spec, wanted);
            return built.map_err(|source| self.not_built("plant", &spec.model, source));
        }
        let robot = self.robot();
        let robot = robot.ok_or_else(|| self.not_built("plant", &spec.model, NO_ROBOT.into()))?;
        self.plant_of(robot, spec, &scenario.actuator, wanted)
    }

    /// The plant of the scene with another robot, set otherwise.
    pub(crate) fn plant_of(
        &self,
        robot: &Robot,
        plant: &PlantSpec,
        actuator: &ActuatorSpec,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, TwinError> {
        let scenario = self.scenario();
        let first_commands = self.first_commands()?;
        let context = PlantContext {
            robot,
            legs: &self.leg_names(),
            plant,
            actuator,
            first_commands: &first_commands,
            command_period: self.period(),
            seed: scenario.seed,
            wanted,
        };
        let name = &plant.model;
        let built = self.registry.plant(&context);
        built
            .unwrap_or_else(|| Err("there is none of that name".into()))
            .and_then(|plant| with_abduction(plant, &context))
            .map_err(|source| self.not_built("plant", name, source))
    }

    /// What the controller commands first, by the names of the signals: the pose that the run begins in.
    fn first_commands(&self) -> Result<Vec<(String, f64)>, TwinError> {
        let mut process = self.process()?;
        let ports = process_ports(&*process);
        let inputs = vec![0.0; Layout::of(&ports, Direction::Input).len()];
        let layout = Layout::of(&ports, Direction::Output);
        let mut outputs = vec![0.0; layout.len()];
        let name = process.name().to_owned();
        in_part(PartKind::Controller, &name, || {
            process.step(SimDuration::ZERO, &inputs, &mut outputs);
        });
        let named = |field: &Field| {
            let values = outputs[field.range()].iter();
            let name = field.port.name.clone();
            values
                .map(move |&value| (name.clone(), value))
                .collect::<Vec<_>>()
        };
        Ok(layout.fields().flat_map(named).collect())
    }

    /// The controller with the variables that the scenario sets; one that does nothing if it has none.
    pub(crate) fn process(&self) -> Result<Box<dyn Process>, TwinError> {
        let scenario = self.scenario();
        let Some(spec) = &scenario.controller else {
            return Ok(Box::new(Idle));
        };
        let (options, seed) = (&spec.options, scenario.seed);
        let built = if let Some(robot) = self.robot() {
            let given = ControllerContext {
                robot,
                legs: &self.leg_names(),
                options,
                seed,
            };
            self.registry.controller(&spec.kind, &given)
        } else {
            let own = self.body.standalone_model();
            let given = LegContext {
                legs: &self.scene.legs,
                taken: &own.map_or_else(Vec::new, StandaloneModel::inputs),
                options,
                seed,
            };
            self.registry.controller_of_legs(&spec.kind, &given)
        };
        let mut process = built
            .unwrap_or_else(|| Err("there is none of that name".into()))
            .map_err(|source| self.not_built("controller", &spec.kind, source))?;
        for (name, value) in &spec.variables {
            set(&mut *process, name, *value).map_err(|error| self.rig_error(error))?;
        }
        Ok(process)
    }

    pub(crate) fn not_built(
        &self,
        what: &'static str,
        name: &str,
        source: crate::BuildError,
    ) -> TwinError {
        TwinError::Build {
            what,
            name: name.to_owned(),
            file: self.scenario().file.clone(),
            source,
        }
    }

    /// What to do where a controller commands what the plant's own model has not been given a signal for.
    fn rig_help(&self, error: &RigError) -> String {
        let unmatched = matches!(error, RigError::Wiring(WiringError::Unmatched { port, .. }) if port.name.starts_with("leg/"));
        let kind = self.scenario().controller.as_ref().map(|spec| &spec.kind);
        match (kind, self.body.standalone_model()) {
            (Some(kind), Some(_)) if unmatched => format!(
                "\n  = help: `{kind}` has the same signals for every leg: map them all in [plant.inputs] and [plant.outputs], or write a controller of your own"
            ),
            _ => String::new(),
        }
    }

    pub(crate) fn rig_error(&self, source: RigError) -> TwinError {
        TwinError::Rig {
            file: self.scenario().file.clone(),
            help: self.rig_help(&source),
            source: Box::new(source),
        }
    }
}

/// Inputs and outputs of a process.
pub(crate) fn process_ports(process: &dyn Process) -> Vec<Port> {
    in_part(PartKind::Controller, process.name(), || process.ports())
}

fn outputs(plant: &dyn Plant) -> Vec<Port> {
    let mut ports = in_part(PartKind::Plant, plant.name(), || plant.ports());
    ports.retain(|port| port.direction == Direction::Output);
    ports
}

fn set(process: &mut dyn Process, name: &str, value: f64) -> Result<(), RigError> {
    let known = process.variables().iter();
    let Some(index) = known.clone().position(|variable| variable.name() == name) else {
        return Err(RigError::NoSuchVariable {
            process: process.name().to_owned(),
            name: name.to_owned(),
            near: Vec::new(),
        });
    };
    let change = |source| RigError::Change {
        at: SimTime::ZERO,
        source,
    };
    process.set_variable(index, value).map_err(change)
}
