//! Builds the parts of a scenario: controller, buses and plant.

use twinrig_kernel::{Direction, Field, Layout, Port, SimDuration, SimTime, signal};
use twinrig_robot::Robot;
use twinrig_runtime::{Driver, PartKind, Plant, Process, RigError, Wire, in_part};
use twinrig_scenario::{ActuatorSpec, LegFact, PlantSpec, PushSite, Scenario};

use crate::assembly::body::Body;
use crate::error::{BuildError, Error, NO_ROBOT};
use crate::parts::abduction::with_abduction;
use crate::parts::context::{PlantContext, StandaloneModel};
use crate::parts::controller_kind::{ControllerContext, LegContext};
use crate::parts::coupling;
use crate::parts::idle::Idle;
use crate::parts::start;
use crate::registry::Registry;

/// The error of a kind that the registry does not have.
const NO_SUCH_KIND: &str = "there is none of that name";

/// The parts of one rig.
pub struct BuiltParts {
    /// Controller.
    pub process: Box<dyn Process>,
    /// Buses, in the order of the scenario.
    pub buses: Vec<Bus>,
    /// Plant.
    pub plant: Box<dyn Plant>,
    /// Names of the random streams that were drawn from meanwhile, outside of a run.
    pub drawn: Vec<String>,
}

/// Both ends of a bus.
pub struct Bus {
    /// Name.
    pub name: String,
    /// Driver.
    pub driver: Box<dyn Driver>,
    /// Wire with the emulated boards.
    pub wire: Box<dyn Wire>,
}

impl Bus {
    /// Diagnostics of the driver, then of the boards.
    pub(crate) fn diagnostics(&self) -> Vec<Port> {
        [self.driver.diagnostics(), self.wire.diagnostics()].concat()
    }
}

/// Sources of the parts.
#[derive(Clone, Copy)]
pub(crate) struct PartBuilder<'a> {
    pub(crate) registry: &'a Registry,
    pub(crate) scenario: &'a Scenario,
    /// The simulated legs, in the robot's order.
    pub(crate) legs: &'a [LegFact],
    pub(crate) body: &'a Body,
}

impl<'a> PartBuilder<'a> {
    pub(crate) fn leg_names(&self) -> Vec<&'a str> {
        self.legs.iter().map(|leg| leg.name.as_str()).collect()
    }

    /// Motors on free shafts of a standalone plant.
    pub(crate) fn motors(&self) -> Vec<String> {
        let inputs = self.body.standalone_model();
        let inputs = inputs.map_or_else(Vec::new, StandaloneModel::inputs);
        let motor = |input: &String| {
            let (motor, what) = signal::parse_motor(input)?;
            (what == "voltage").then(|| motor.to_owned())
        };
        inputs.iter().filter_map(motor).collect()
    }

    /// The control period.
    pub(crate) fn period(&self) -> SimDuration {
        self.scenario.period()
    }

    pub(crate) fn not_built(&self, what: &'static str, name: &str, source: BuildError) -> Error {
        Error::not_built(self.scenario, what, name, source)
    }

    pub(crate) fn plant_error(&self, source: BuildError) -> Error {
        self.not_built("plant", &self.scenario.plant.model, source)
    }

    /// The controller with the variables that the scenario sets; an idle process if there is none.
    pub(crate) fn process(&self) -> Result<Box<dyn Process>, Error> {
        let Some(spec) = &self.scenario.controller else {
            return Ok(Box::new(Idle));
        };
        let (options, seed) = (&spec.options, self.scenario.seed);
        let built = if let Some(robot) = self.body.robot() {
            let context = ControllerContext {
                robot,
                legs: &self.leg_names(),
                options,
                seed,
            };
            self.registry.controller(&spec.kind, &context)
        } else {
            let model = self.body.standalone_model();
            let context = LegContext {
                legs: self.legs,
                taken: &model.map_or_else(Vec::new, StandaloneModel::inputs),
                options,
                seed,
            };
            self.registry.controller_of_legs(&spec.kind, &context)
        };
        let mut process = built
            .unwrap_or_else(|| Err(NO_SUCH_KIND.into()))
            .map_err(|source| self.not_built("controller", &spec.kind, source))?;
        for (name, value) in &spec.variables {
            let set = set(&mut *process, name, *value);
            set.map_err(|source| Error::rig(self.scenario, source))?;
        }
        Ok(process)
    }

    /// First commands of a process, by signal name: the pose at the start. The process keeps its
    /// state.
    pub(crate) fn first_commands(
        &self,
        process: &mut dyn Process,
    ) -> Result<Vec<(String, f64)>, Error> {
        let ports = process_ports(process);
        let inputs = vec![0.0; Layout::of(&ports, Direction::Input).len()];
        let layout = Layout::of(&ports, Direction::Output);
        let mut outputs = vec![0.0; layout.len()];
        let name = process.name().to_owned();
        let restored = in_part(PartKind::Controller, &name, || -> Result<(), BuildError> {
            let saved = process.save();
            process.step(SimDuration::ZERO, &inputs, &mut outputs);
            if let Some(why) = process.fault() {
                return Err(format!("its first iteration failed: {why}").into());
            }
            Ok(process.restore(&saved)?)
        });
        restored.map_err(|source| self.not_built("controller", &name, source))?;
        let named = |field: &Field| {
            let values = outputs[field.range()].iter();
            let name = field.port.name.clone();
            values
                .map(move |&value| (name.clone(), value))
                .collect::<Vec<_>>()
        };
        Ok(layout.fields().flat_map(named).collect())
    }

    /// Every output that the plant offers for the simulated legs.
    pub(crate) fn plant_outputs(
        &self,
        first_commands: &[(String, f64)],
    ) -> Result<Vec<Port>, Error> {
        let ports = if let Some(model) = self.body.standalone_model() {
            Ok(model.ports())
        } else {
            let robot = self.body.robot();
            let robot = robot.ok_or_else(|| self.plant_error(NO_ROBOT.into()))?;
            let legs = self.leg_names();
            let (plant, actuator) = (&self.scenario.plant, &self.scenario.actuator);
            // The scene reports pushes on other feet at their place.
            let mut pushes = self.scenario.pushes.clone();
            pushes.retain(|push| match &push.on {
                PushSite::Trunk => true,
                PushSite::Foot(leg) => legs.contains(&leg.value.as_str()),
            });
            let context = PlantContext {
                pushes: &pushes,
                ..self.plant_context(robot, &legs, plant, actuator, first_commands, &|_| true)
            };
            let ports = self.registry.plant_ports(&context);
            ports.unwrap_or_else(|| Err(NO_SUCH_KIND.into()))
        };
        let mut ports = ports.map_err(|source| self.plant_error(source))?;
        ports.retain(|port| port.direction == Direction::Output);
        ports.extend(self.body.sensors().ports());
        Ok(ports)
    }

    fn plant_context<'c>(
        &'c self,
        robot: &'c Robot,
        legs: &'c [&'c str],
        plant: &'c PlantSpec,
        actuator: &'c ActuatorSpec,
        first_commands: &'c [(String, f64)],
        wanted: &'c dyn Fn(&str) -> bool,
    ) -> PlantContext<'c> {
        PlantContext {
            robot,
            legs,
            plant,
            actuator,
            pushes: &self.scenario.pushes,
            first_commands,
            command_period: self.period(),
            seed: self.scenario.seed,
            wanted,
        }
    }

    /// The plant that computes the `wanted` ones of its outputs, with the sensors mounted on it and
    /// coupled as the scenario says.
    pub(crate) fn coupled_plant(
        &self,
        first_commands: &[(String, f64)],
        outputs: &[Port],
        wanted: &[String],
    ) -> Result<Box<dyn Plant>, Error> {
        let plant = self.bare_plant(first_commands, outputs, wanted)?;
        let coupling = self.scenario.plant.coupling;
        let wanted = |name: &str| wanted.iter().any(|other| other == name);
        let needed = self.needed(outputs, &wanted);
        let with_sensors = |name: &str| needed.contains(&name);
        let plant = self.body.sensors().around(plant, &with_sensors);
        let coupled = plant.and_then(|plant| coupling::coupled(coupling, plant, &wanted));
        coupled.map_err(|source| self.plant_error(source))
    }

    /// The same plant alone: with the outputs that sensors and coupling need, and without both.
    pub(crate) fn bare_plant(
        &self,
        first_commands: &[(String, f64)],
        outputs: &[Port],
        wanted: &[String],
    ) -> Result<Box<dyn Plant>, Error> {
        let spec = &self.scenario.plant;
        let wanted = |name: &str| wanted.iter().any(|other| other == name);
        let needed = self.needed(outputs, &wanted);
        let sensors = self.body.sensors();
        let with_sensors = |name: &str| needed.contains(&name);
        let computed = |name: &str| with_sensors(name) || sensors.need(name, &with_sensors);
        match (self.body.standalone_model(), self.body.robot()) {
            (Some(model), _) => {
                let built = model.build(spec, &computed);
                built.map_err(|source| self.plant_error(source))
            }
            (None, Some(robot)) => {
                let actuator = &self.scenario.actuator;
                self.plant_of(robot, spec, actuator, first_commands, &computed)
            }
            (None, None) => Err(self.plant_error(NO_ROBOT.into())),
        }
    }

    /// Names of the outputs that the coupled plant needs for the `wanted` ones.
    fn needed<'o>(&self, outputs: &'o [Port], wanted: &dyn Fn(&str) -> bool) -> Vec<&'o str> {
        let coupling = self.scenario.plant.coupling;
        let needed = outputs.iter();
        let needed = needed.filter(|port| coupling::needs(coupling, port, wanted));
        needed.map(|port| port.name.as_str()).collect()
    }

    /// The plant on a robot, with these settings.
    pub(crate) fn plant_of(
        &self,
        robot: &Robot,
        plant: &PlantSpec,
        actuator: &ActuatorSpec,
        first_commands: &[(String, f64)],
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, Error> {
        let legs = self.leg_names();
        let context = self.plant_context(robot, &legs, plant, actuator, first_commands, wanted);
        self.registry
            .plant(&context)
            .unwrap_or_else(|| Err(NO_SUCH_KIND.into()))
            .and_then(|plant| with_abduction(plant, &context))
            .map_err(|source| match start::mistake(&context) {
                Some(problem) => Error::Document(problem.into()),
                None => self.not_built("plant", &plant.model, source),
            })
    }
}

/// Inputs and outputs of a process.
pub(crate) fn process_ports(process: &dyn Process) -> Vec<Port> {
    in_part(PartKind::Controller, process.name(), || process.ports())
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
