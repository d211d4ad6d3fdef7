//! Buses and direct connections between controller and plant.

use twinrig_document::{DocumentError, suggestion};
use twinrig_kernel::{Direction, Port};
use twinrig_runtime::{BusHealth, DirectIo, IoTask, Process, RigError, WiredTask};
use twinrig_scenario::{BusSpec, FaultSpec, Scenario, matches};

use crate::assembly::builder::{Bus, PartBuilder};
use crate::error::{BuildError, Error};
use crate::parts::bus_kind::{BusContext, BusKind};

/// Name of the task that transfers the signals without a bus.
const DIRECT: &str = "io";

impl PartBuilder<'_> {
    /// Builds drivers and wires of all buses, for a process with these ports.
    pub(crate) fn buses(&self, process_ports: &[Port]) -> Result<Vec<Bus>, Error> {
        let built = |bus: &BusSpec| -> Result<Bus, Error> {
            let kind = self.bus_kind(bus)?;
            Ok(Bus {
                name: bus.name.value.clone(),
                driver: self.built_bus(bus, process_ports, |context| kind.driver(context))?,
                wire: self.built_bus(bus, process_ports, |context| kind.wire(context))?,
            })
        };
        let buses: Vec<Bus> = self
            .scenario
            .buses
            .iter()
            .map(built)
            .collect::<Result<_, _>>()?;
        let carried = |bus: &Bus| -> Vec<String> {
            let ports = bus.driver.ports().into_iter();
            let commands = ports.filter(|port| port.direction == Direction::Input);
            commands.map(|port| port.name).collect()
        };
        for (n, bus) in buses.iter().enumerate() {
            let commands = carried(bus);
            for other in &buses[..n] {
                let others = carried(other);
                let Some(both) = commands.iter().find(|name| others.contains(name)) else {
                    continue;
                };
                let why = format!("the bus `{}` carries `{both}`, too", other.name);
                return Err(self.not_built("bus", &bus.name, why.into()));
            }
        }
        Ok(buses)
    }

    /// Builds the tasks of a process with these ports: one per bus, and one for the signals without
    /// a bus. Monitors need none.
    pub(crate) fn tasks(
        &self,
        buses: Vec<Bus>,
        process: &dyn Process,
        process_ports: &[Port],
    ) -> Result<Vec<Box<dyn IoTask>>, Error> {
        let mut tasks: Vec<Box<dyn IoTask>> = Vec::new();
        let mut carried: Vec<Port> = Vec::new();
        for Bus { driver, wire, .. } in buses {
            carried.extend(driver.ports());
            tasks.push(Box::new(WiredTask::new(driver, wire)));
        }
        let rest: Vec<Port> = process_ports
            .iter()
            .filter(|port| !carried.iter().any(|other| other.connects(port)))
            .filter(|port| !process.is_monitor(&port.name))
            .cloned()
            .collect();
        if !rest.is_empty() || tasks.is_empty() {
            let transfer = self.scenario.io.transfer_time.clone();
            let io = DirectIo::for_process(DIRECT, &rest, transfer, self.scenario.seed);
            let io = io.map_err(|error| Error::rig(self.scenario, RigError::Compute(error)))?;
            tasks.push(Box::new(io));
        }
        Ok(tasks)
    }

    /// Returns the kind of a bus.
    pub(crate) fn bus_kind(&self, bus: &BusSpec) -> Result<&BusKind, Error> {
        let missing = || self.not_built("bus", &bus.kind, "there is none of that name".into());
        self.registry.bus(&bus.kind).ok_or_else(missing)
    }

    /// Returns the plant outputs that boards measure.
    pub(crate) fn measured(&self, plant_outputs: &[Port]) -> Vec<String> {
        let of_bus = |bus: &BusSpec| Some(self.registry.bus(&bus.kind)?.measured(&bus.options));
        let buses = self.scenario.buses.iter();
        let patterns: Vec<String> = buses.filter_map(of_bus).flatten().collect();
        let measured = |name: &str| patterns.iter().any(|pattern| matches(pattern, name));
        let names = plant_outputs.iter().map(|port| port.name.clone());
        names.filter(|name| measured(name)).collect()
    }

    /// Checks that the place of every fault exists on its bus.
    pub(crate) fn check_fault_places(&self) -> Result<(), Error> {
        let scenario = self.scenario;
        for fault in &scenario.faults {
            let Some((bus, place)) = scenario.buses.iter().find_map(|bus| place(bus, fault)) else {
                continue;
            };
            let kind = self.bus_kind(bus)?;
            let motors = self.motors();
            let boards = self.leg_names().into_iter();
            let boards: Vec<&str> = boards.chain(motors.iter().map(String::as_str)).collect();
            let places = kind.places(&boards);
            let known = match place {
                "" => kind.has_faults(),
                place => places.iter().any(|known| known == place),
            };
            if known {
                check_message(bus, kind, fault)?;
                if fault.kind.acts_on_boards() && !kind.has_boards_at(place, &boards) {
                    return Err(no_boards(fault).into());
                }
                continue;
            }
            if places.is_empty() && !kind.has_faults() {
                let message = format!("the wire of the bus `{}` takes no faults", bus.name.value);
                let help = "its kind declares none";
                return Err(fault.on.error(message, help).into());
            }
            let wire = format!("wire/{}", bus.name.value);
            let known: Vec<String> = places
                .iter()
                .map(|known| format!("{wire}/{known}"))
                .collect();
            let known = std::iter::once(wire.as_str()).chain(known.iter().map(String::as_str));
            let message = format!("there is no place `{}` in this scene", fault.on.value);
            let help = suggestion(&fault.on.value, "places", known);
            return Err(fault.on.error(message, help).into());
        }
        Ok(())
    }

    /// Builds a part of a bus for a process with these ports.
    pub(super) fn built_bus<T>(
        &self,
        bus: &BusSpec,
        process_ports: &[Port],
        build: impl FnOnce(&BusContext<'_>) -> Result<T, BuildError>,
    ) -> Result<T, Error> {
        let scenario = self.scenario;
        let faults: Vec<(&str, &FaultSpec)> = scenario
            .faults
            .iter()
            .filter_map(|fault| place(bus, fault).map(|(_, place)| (place, fault)))
            .collect();
        let motors = self.motors();
        let motors: Vec<&str> = motors.iter().map(String::as_str).collect();
        let context = BusContext {
            name: &bus.name.value,
            robot: self.body.robot(),
            legs: &self.leg_names(),
            motors: &motors,
            process_ports,
            period: self.period(),
            actuator: &scenario.actuator,
            options: &bus.options,
            faults: &faults,
            seed: scenario.seed,
            calibrations: self.body.sensors().calibrations(),
        };
        build(&context).map_err(|source| self.not_built("bus", &bus.kind, source))
    }
}

/// Checks that the messages behind which a fault counts frames exist on its bus.
fn check_message(bus: &BusSpec, kind: &BusKind, fault: &FaultSpec) -> Result<(), Error> {
    let Some(after) = &fault.after else {
        return Ok(());
    };
    let messages = kind.messages(&bus.options);
    if messages.contains(&after.value.as_str()) {
        return Ok(());
    }
    let message = format!(
        "there is no message `{}` on `{}`",
        after.value, fault.on.value
    );
    let help = if messages.is_empty() {
        "its frames have no kinds: choose them by `nth` or `every`".to_owned()
    } else {
        suggestion(&after.value, "messages", messages)
    };
    Err(after.error(message, help).into())
}

/// Reports a fault of boards where there are none that have it.
fn no_boards(fault: &FaultSpec) -> DocumentError {
    let (kind, on) = (fault.kind.name(), &fault.on.value);
    let message = format!("no board at `{on}` has a fault `{kind}`");
    let help = "boards on buses of `sbcp`, `dynamixel` and `feetech` have it: one of them, or all \
                by the name of the bus; elsewhere use `unplug`";
    fault.on.error(message, help)
}

/// Returns the faults of a scenario without an effect on the bus of this name, which has this
/// health: each with its number, from 1.
pub(crate) fn idle_faults<'s>(
    scenario: &'s Scenario,
    bus: &str,
    health: &BusHealth,
) -> Vec<(usize, &'s FaultSpec)> {
    let Some(bus) = scenario.bus(bus) else {
        return Vec::new();
    };
    let numbered = scenario.faults.iter().zip(1..);
    let on_bus = numbered.filter(|(fault, _)| place(bus, fault).is_some());
    let is_idle = |index: usize| {
        let mut effects = health
            .fault_effects
            .iter()
            .filter(|it| it.fault == index)
            .peekable();
        // Faults that the wire does not count are not judged.
        effects.peek().is_some() && effects.all(|it| it.harmed == 0)
    };
    let idle = on_bus.enumerate().filter(|(index, _)| is_idle(*index));
    idle.map(|(_, (fault, number))| (number, fault)).collect()
}

/// Returns the place of a fault on `bus`: `LF` of `wire/sbcp/LF`, empty of `wire/sbcp`; `None` for
/// faults of other buses.
fn place<'s>(bus: &'s BusSpec, fault: &'s FaultSpec) -> Option<(&'s BusSpec, &'s str)> {
    let rest = fault.on.value.strip_prefix("wire/")?;
    let rest = rest.strip_prefix(bus.name.value.as_str())?;
    if rest.is_empty() {
        return Some((bus, rest));
    }
    rest.strip_prefix('/').map(|place| (bus, place))
}
