//! The buses of a scene: what carries the signals between controller and plant.

use twinrig_document::suggestion;
use twinrig_kernel::Port;
use twinrig_runtime::{DirectIo, Driver, IoTask, RigError, Wire, WiredTask};
use twinrig_scenario::{BusSpec, FaultSpec, matches};

use crate::assembly::Assembly;
use crate::error::NO_ROBOT;
use crate::error::TwinError;
use crate::parts::bus_kind::{BusContext, BusKind};

/// What carries the signals that no bus does.
const DIRECT: &str = "io";

/// A wire and the name of its bus.
pub(crate) type NamedWire = (String, Box<dyn Wire>);

impl Assembly<'_> {
    /// The tasks that carry the signals of a process with these ports: one for each bus, and one for what no bus carries.
    pub(crate) fn tasks(&self, process_ports: &[Port]) -> Result<Vec<Box<dyn IoTask>>, TwinError> {
        let scenario = self.scenario();
        let mut tasks: Vec<Box<dyn IoTask>> = Vec::new();
        let mut carried: Vec<Port> = Vec::new();
        for bus in &scenario.buses {
            let driver = self.driver(bus, process_ports)?;
            carried.extend(driver.ports());
            let kind = self.bus_kind(bus)?;
            let wire = self.hooked_up(bus, process_ports, |context| kind.wire(context))?;
            tasks.push(Box::new(WiredTask::new(driver, wire)));
        }
        let rest: Vec<Port> = process_ports
            .iter()
            .filter(|port| !carried.contains(&port.mirrored()))
            .cloned()
            .collect();
        if !rest.is_empty() || tasks.is_empty() {
            let transfer = scenario.io.transfer_time.clone();
            let io = DirectIo::for_process(DIRECT, &rest, transfer, scenario.seed)
                .map_err(|error| self.rig_error(RigError::Compute(error)))?;
            tasks.push(Box::new(io));
        }
        Ok(tasks)
    }

    /// The wires of all buses, by name, with the boards at their far ends.
    pub(crate) fn wires(&self) -> Result<Vec<NamedWire>, TwinError> {
        let process_ports = self.process()?.ports();
        let buses = self.scenario().buses.iter();
        let wire = |bus: &BusSpec| {
            let kind = self.bus_kind(bus)?;
            let wire = self.hooked_up(bus, &process_ports, |context| kind.wire(context))?;
            Ok((bus.name.value.clone(), wire))
        };
        buses.map(wire).collect()
    }

    /// The driver of a bus.
    pub(crate) fn driver(
        &self,
        bus: &BusSpec,
        process_ports: &[Port],
    ) -> Result<Box<dyn Driver>, TwinError> {
        let kind = self.bus_kind(bus)?;
        self.hooked_up(bus, process_ports, |context| kind.driver(context))
    }

    /// The kind of a bus, which the scenario was checked for.
    pub(crate) fn bus_kind(&self, bus: &BusSpec) -> Result<&BusKind, TwinError> {
        let missing = || self.not_built("bus", &bus.kind, "there is none of that name".into());
        self.registry.bus(&bus.kind).ok_or_else(missing)
    }

    /// What drivers and boards count, of a process with these ports.
    pub(crate) fn diagnostics_of(&self, process_ports: &[Port]) -> Result<Vec<Port>, TwinError> {
        let tasks = self.tasks(process_ports)?;
        Ok(tasks.iter().flat_map(|task| task.diagnostics()).collect())
    }

    /// Those of the plant's outputs that boards measure.
    pub(crate) fn measured(&self, plant_outputs: &[Port]) -> Vec<String> {
        let of_bus = |bus: &BusSpec| Some(self.registry.bus(&bus.kind)?.measured(&bus.options));
        let buses = self.scenario().buses.iter();
        let patterns: Vec<String> = buses.filter_map(of_bus).flatten().collect();
        let measured = |name: &str| patterns.iter().any(|pattern| matches(pattern, name));
        let names = plant_outputs.iter().map(|port| port.name.clone());
        names.filter(|name| measured(name)).collect()
    }

    /// Every fault is at a place that its bus has.
    pub(crate) fn check_fault_places(&self) -> Result<(), TwinError> {
        let scenario = self.scenario();
        for fault in &scenario.faults {
            let Some((bus, place)) = scenario.buses.iter().find_map(|bus| place(bus, fault)) else {
                continue;
            };
            let kind = self.bus_kind(bus)?;
            let places = kind.places(&self.leg_names());
            let known = match place {
                "" => kind.has_faults(),
                place => places.iter().any(|known| known == place),
            };
            if known {
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

    fn hooked_up<T>(
        &self,
        bus: &BusSpec,
        process_ports: &[Port],
        build: impl FnOnce(&BusContext<'_>) -> Result<T, crate::BuildError>,
    ) -> Result<T, TwinError> {
        let scenario = self.scenario();
        let faults: Vec<(&str, &FaultSpec)> = scenario
            .faults
            .iter()
            .filter_map(|fault| place(bus, fault).map(|(_, place)| (place, fault)))
            .collect();
        let robot = self.robot();
        let robot = robot.ok_or_else(|| self.not_built("bus", &bus.kind, NO_ROBOT.into()))?;
        let context = BusContext {
            name: &bus.name.value,
            robot,
            legs: &self.leg_names(),
            process_ports,
            period: self.period(),
            options: &bus.options,
            faults: &faults,
            seed: scenario.seed,
        };
        build(&context).map_err(|source| self.not_built("bus", &bus.kind, source))
    }
}

/// The place of a fault on `bus`, if that is where it happens: `LF` of `wire/sbcp/LF`, nothing of `wire/sbcp`.
fn place<'s>(bus: &'s BusSpec, fault: &'s FaultSpec) -> Option<(&'s BusSpec, &'s str)> {
    let rest = fault.on.value.strip_prefix("wire/")?;
    let rest = rest.strip_prefix(bus.name.value.as_str())?;
    if rest.is_empty() {
        return Some((bus, rest));
    }
    rest.strip_prefix('/').map(|place| (bus, place))
}
