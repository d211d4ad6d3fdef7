//! From a scenario file to a rig.

use std::sync::{Mutex, PoisonError};

use twinrig_document::Overrides;
use twinrig_kernel::{Port, SimDuration, SimTime, count_drawn, drawn_streams, signal};
use twinrig_legged::Constraints;
use twinrig_robot::Robot;
use twinrig_runtime::{Change, Plant, Rig, Schedule, Timing};
use twinrig_scenario::{
    Abduction, ActuatorSpec, BusSpec, CommandedGait, Facts, PlantSpec, Scenario, Scene, Setting,
};

use crate::start::StartPerturbation;

mod assembly_builder;
pub mod body;
pub mod builder;
pub(crate) mod buses;
mod commanded_gait;
mod failure;
mod instrumented;
mod plausibility;
pub mod recording_size;
pub mod refinement;
mod sensed;
pub(crate) mod sensors;
pub mod sources;

pub use assembly_builder::AssemblyBuilder;

use crate::assembly::body::Body;
use crate::assembly::builder::{BuiltParts, PartBuilder};
use crate::assembly::sources::Sources;
use crate::error::Error;
use crate::parts::constraints::{self, named_constraints};
use crate::parts::decoder::{Decoder, Direction};
use crate::parts::setup::ground_below;
use crate::registry::Registry;

/// Returns the patterns of the signals from which poses are drawn.
fn frame_signals(scenario: &Scenario) -> Vec<String> {
    let of_legs = |what| signal::of_leg("*", what);
    let mut signals = vec![
        signal::BODY_POSITION.to_owned(),
        signal::BODY_ORIENTATION.to_owned(),
        of_legs(signal::ANGLES),
    ];
    // Servos beside a plant do not move its legs.
    if scenario.plant.abduction == Abduction::Free {
        signals.push(of_legs(signal::ABDUCTION_POSITION));
    }
    signals
}

/// A checked scenario with its pruned scene, from which rigs are built.
///
/// ```no_run
/// use std::path::Path;
/// use twinrig_rig::{Assembly, Registry};
/// use twinrig_kernel::{SimDuration, SimTime};
///
/// let registry = Registry::standard();
/// let assembly = Assembly::builder(&registry).file(Path::new("scenarios/trot.toml"))?;
/// let mut rig = assembly.rig()?;
/// rig.run_until(SimTime::ZERO + SimDuration::from_secs(1), &mut ())?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Assembly<'r> {
    pub(crate) registry: &'r Registry,
    scene: Scene,
    body: Body,
    facts: Facts,
    /// First commands of the controller, by signal name: the pose at the start.
    first_commands: Vec<(String, f64)>,
    /// Commanded motion that samples do not contain.
    gait: CommandedGait,
    /// Perturbation of the plant's start.
    start: Option<StartPerturbation>,
    /// The parts that were built to check the scenario: those of the first rig.
    built: Mutex<Option<BuiltParts>>,
}

impl<'r> Assembly<'r> {
    /// Reads a scenario from its sources.
    fn of(registry: &'r Registry, sources: &Sources, settings: &[Setting]) -> Result<Self, Error> {
        let (assembly, drawn) = drawn_streams(|| Self::build(registry, sources, settings));
        let mut assembly = assembly?;
        let built = assembly.built.get_mut();
        if let Some(parts) = built.unwrap_or_else(PoisonError::into_inner) {
            parts.drawn = drawn;
        }
        Ok(assembly)
    }

    fn build(
        registry: &'r Registry,
        sources: &Sources,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let (mut scenario, body) = sources.body(registry, settings)?;
        let legs = scenario.legs(&body.legs())?;
        let has_choice = registry.has_constraints(&scenario.plant.model);
        let rigid = constraints::complete(
            &mut scenario,
            has_choice,
            body.robot(),
            &legs,
            sources.rules,
        );
        let builder = PartBuilder {
            registry,
            scenario: &scenario,
            legs: &legs,
            body: &body,
        };
        builder.check_fault_places()?;
        let mut process = builder.process()?;
        let process_ports = builder::process_ports(&*process);
        let first_commands = builder.first_commands(&mut *process)?;
        let buses = builder.buses(&process_ports)?;
        let plant_outputs = builder.plant_outputs(&first_commands)?;
        let ground = ground_below(&scenario.plant, scenario.seed);
        let ground = ground.map_err(|source| builder.plant_error(source))?;
        let facts = Facts {
            weight: body.weight(),
            measured: builder.measured(&plant_outputs),
            diagnostics: buses.iter().flat_map(builder::Bus::diagnostics).collect(),
            plant_outputs,
            process_ports,
            frame_signals: frame_signals(&scenario),
            ground,
            legs,
        };
        let gait = commanded_gait::of(process.variables(), &scenario, &facts.legs, body.robot());
        let mut scene = scenario.scene(&facts)?;
        let large = recording_size::warning(&scene, &facts.plant_outputs, &facts.process_ports);
        scene.scenario.warnings.extend(large);
        scene.scenario.warnings.extend(body.warnings());
        scene.left_out.extend(rigid);
        let mut assembly = Self {
            registry,
            scene,
            body,
            facts,
            first_commands,
            gait,
            start: None,
            built: Mutex::default(),
        };
        let plant = assembly.plant()?;
        let parts = BuiltParts {
            process,
            buses,
            plant,
            drawn: Vec::new(),
        };
        assembly.built = Mutex::new(Some(parts));
        Ok(assembly)
    }

    fn part_builder(&self) -> PartBuilder<'_> {
        PartBuilder {
            registry: self.registry,
            scenario: self.scenario(),
            legs: &self.scene.legs,
            body: &self.body,
        }
    }

    /// Returns the parts of a rig: those built to check the scenario, or new ones if a rig has
    /// taken them.
    ///
    /// # Errors
    /// A part that cannot be built.
    pub fn parts(&self) -> Result<BuiltParts, Error> {
        let built = self.built.lock();
        if let Some(parts) = built.unwrap_or_else(PoisonError::into_inner).take() {
            count_drawn(&parts.drawn);
            return Ok(parts);
        }
        let builder = self.part_builder();
        Ok(BuiltParts {
            process: builder.process()?,
            buses: builder.buses(&self.facts.process_ports)?,
            plant: self.plant()?,
            drawn: Vec::new(),
        })
    }

    /// Builds the plant with the outputs that the scene requires, coupled as the scenario
    /// specifies.
    fn plant(&self) -> Result<Box<dyn Plant>, Error> {
        let builder = self.part_builder();
        let outputs = &self.facts.plant_outputs;
        builder.coupled_plant(&self.first_commands, outputs, &self.scene.wanted)
    }

    /// Builds the plant of the scene alone, without the sensors and the coupling of its rig; it
    /// computes `also` besides the required outputs.
    ///
    /// # Errors
    /// A plant that cannot be built.
    pub fn bare_plant(&self, also: &[String]) -> Result<Box<dyn Plant>, Error> {
        let wanted = [&self.scene.wanted, also].concat();
        let outputs = &self.facts.plant_outputs;
        self.part_builder()
            .bare_plant(&self.first_commands, outputs, &wanted)
    }

    /// Builds the plant of the scene as [`Self::bare_plant`] does, with further values of the file
    /// of its robot or model replaced.
    ///
    /// # Errors
    /// Values that are not accepted, and a plant that cannot be built.
    pub fn overridden_plant(
        &self,
        overrides: &Overrides,
        also: &[String],
    ) -> Result<Box<dyn Plant>, Error> {
        let body = self
            .body
            .overridden(self.registry, self.scenario(), overrides)?;
        let wanted = [&self.scene.wanted, also].concat();
        let builder = PartBuilder {
            body: &body,
            ..self.part_builder()
        };
        builder.bare_plant(&self.first_commands, &self.facts.plant_outputs, &wanted)
    }

    /// Builds the plant of the scene with another robot and other settings.
    ///
    /// # Errors
    /// The plant cannot be built so.
    pub fn plant_of(
        &self,
        robot: &Robot,
        plant: &PlantSpec,
        actuator: &ActuatorSpec,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, Error> {
        let commands = &self.first_commands;
        let builder = self.part_builder();
        builder.plant_of(robot, plant, actuator, commands, wanted)
    }

    /// Returns the same robot, controller and buses under another scenario; the plant computes the
    /// `compared` outputs besides the required ones.
    ///
    /// # Errors
    /// As [`Scenario::scene`].
    pub fn with_scenario(&self, scenario: &Scenario, compared: &[String]) -> Result<Self, Error> {
        let mut facts = self.facts.clone();
        facts.measured.extend_from_slice(compared);
        Ok(Self {
            registry: self.registry,
            scene: scenario.scene(&facts)?,
            body: self.body.clone(),
            first_commands: self.first_commands.clone(),
            gait: self.gait.clone(),
            start: self.start,
            built: Mutex::default(),
            facts,
        })
    }

    /// Returns the same scenario with further values of the file of its robot or model replaced.
    ///
    /// # Errors
    /// Values that are not accepted.
    pub fn with_values(&self, overrides: &Overrides) -> Result<Self, Error> {
        let body = self
            .body
            .overridden(self.registry, self.scenario(), overrides)?;
        let builder = PartBuilder {
            body: &body,
            ..self.part_builder()
        };
        let mut process = builder.process()?;
        let legs = &self.facts.legs;
        let gait = commanded_gait::of(process.variables(), self.scenario(), legs, body.robot());
        let first_commands = builder.first_commands(&mut *process)?;
        let facts = Facts {
            weight: body.weight(),
            ..self.facts.clone()
        };
        Ok(Self {
            registry: self.registry,
            scene: self.scenario().scene(&facts)?,
            body,
            facts,
            first_commands,
            gait,
            start: self.start,
            built: Mutex::default(),
        })
    }

    /// Returns the kinds of parts of which it is built.
    pub fn registry(&self) -> &'r Registry {
        self.registry
    }

    /// Returns the scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the commanded motion that samples do not contain.
    pub(crate) fn gait(&self) -> &CommandedGait {
        &self.gait
    }

    /// Returns the scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scene.scenario
    }

    /// Returns the robot with the scenario's overrides; `None` for a standalone plant without one.
    pub fn robot(&self) -> Option<&Robot> {
        self.body.robot()
    }

    /// Returns name and text of the robot file.
    pub fn robot_file(&self) -> Option<(&str, &str)> {
        self.body.robot_file()
    }

    /// Returns the simulated body, before pruning.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Returns the name of the formulation of the constraints, where the plant has a choice.
    pub fn constraints(&self) -> Option<&'static str> {
        let plant = &self.scenario().plant;
        let named = || named_constraints(&plant.options).map(Constraints::name);
        self.registry
            .has_constraints(&plant.model)
            .then(named)
            .flatten()
    }

    /// Returns the diagnostics of drivers and boards.
    pub fn diagnostics(&self) -> &[Port] {
        &self.facts.diagnostics
    }

    /// Returns every output that the plant offers, computed or left out.
    pub fn plant_outputs(&self) -> &[Port] {
        &self.facts.plant_outputs
    }

    /// Returns the reference run: the same without changes and expectations.
    #[must_use]
    pub fn without_changes(&self) -> Self {
        Self {
            registry: self.registry,
            scene: Scene {
                scenario: self.scene.scenario.without_changes(),
                ..self.scene.clone()
            },
            body: self.body.clone(),
            facts: self.facts.clone(),
            first_commands: self.first_commands.clone(),
            gait: self.gait.clone(),
            start: self.start,
            built: Mutex::default(),
        }
    }

    /// Returns the same scene from a perturbed start; so is that of its run without changes.
    #[must_use]
    pub fn with_start(&self, start: StartPerturbation) -> Self {
        Self {
            registry: self.registry,
            scene: self.scene.clone(),
            body: self.body.clone(),
            facts: self.facts.clone(),
            first_commands: self.first_commands.clone(),
            gait: self.gait.clone(),
            start: Some(start),
            built: Mutex::default(),
        }
    }

    /// Returns inputs and outputs of the controller.
    pub fn process_ports(&self) -> &[Port] {
        &self.facts.process_ports
    }

    /// Builds the parts, wires them and schedules the changes.
    ///
    /// # Errors
    /// A part that cannot be built, or signals that do not connect.
    pub fn rig(&self) -> Result<Rig, Error> {
        let mut rig = self.rig_around(|plant| plant)?;
        rig.set_end(Some(self.scenario().end()));
        Ok(rig)
    }

    /// Builds the rig with a wrapper around the plant.
    ///
    /// # Errors
    /// As [`Assembly::rig`].
    pub fn rig_around(
        &self,
        around: impl FnOnce(Box<dyn Plant>) -> Box<dyn Plant>,
    ) -> Result<Rig, Error> {
        self.rig_of(self.parts()?, around)
    }

    /// Wires parts, with a wrapper around the plant.
    fn rig_of(
        &self,
        parts: BuiltParts,
        around: impl FnOnce(Box<dyn Plant>) -> Box<dyn Plant>,
    ) -> Result<Rig, Error> {
        let BuiltParts {
            process,
            buses,
            mut plant,
            drawn: _,
        } = parts;
        if let Some(start) = &self.start {
            let file = || self.scenario().file.clone();
            let applied = start.apply(&mut *plant);
            applied.map_err(|why| Error::Start { file: file(), why })?;
        }
        let ports = &self.facts.process_ports;
        let tasks = self.part_builder().tasks(buses, &*process, ports)?;
        let rig = Rig::new(&self.schedule(), process, tasks, around(plant));
        let mut rig = rig.map_err(|error| self.rig_error(error))?;
        self.add_sensors(&mut rig)?;
        for (at, variable, change) in self.changes() {
            rig.schedule(at, variable, change)
                .map_err(|error| self.rig_error(error))?;
        }
        Ok(rig)
    }

    /// Returns the changes of process variables with their times.
    pub fn changes(&self) -> impl Iterator<Item = (SimTime, &str, Change)> {
        let changes = self.scenario().changes.iter();
        changes.map(|change| (change.at, change.variable.as_str(), change.change))
    }

    /// Returns the schedule of the rig.
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

    /// Returns the control period.
    pub fn period(&self) -> SimDuration {
        self.scenario().period()
    }

    /// Returns the end of the run.
    pub fn end(&self) -> SimTime {
        self.scenario().end()
    }

    /// Returns the baud rate of the serial port of a bus \[bit/s\].
    ///
    /// # Errors
    /// [`Error`] if this build does not have its kind.
    pub fn baud(&self, bus: &BusSpec) -> Result<u32, Error> {
        Ok(self.part_builder().bus_kind(bus)?.baud(&bus.options))
    }

    /// Returns a decoder of the bytes of a trace, `BUS/in` or `BUS/out`; none for other traces, and
    /// for buses whose kind has none.
    pub fn decoder(&self, trace: &str) -> Option<Decoder> {
        let (bus, direction) = trace.split_once('/')?;
        let direction = match direction {
            "out" => Direction::ToBoards,
            "in" => Direction::ToDriver,
            _ => return None,
        };
        let bus = self.scenario().bus(bus)?;
        self.registry
            .bus(&bus.kind)?
            .decoder(&bus.options, direction)
    }

    pub(crate) fn leg_names(&self) -> Vec<&str> {
        self.part_builder().leg_names()
    }
}
