//! Rigs whose driver of one bus is another one.

use twinrig_runtime::{Driver, PartKind, Rig, in_part};

use crate::assembly::Assembly;
use crate::error::{BuildError, Error};
use crate::parts::bus_kind::BusContext;

impl Assembly<'_> {
    /// Builds the rig with another driver of the bus `name`, with the same signals: the scenario's
    /// own, instrumented.
    ///
    /// # Errors
    /// As [`Assembly::rig`]; no bus of that name.
    pub fn rig_with_driver(
        &self,
        name: &str,
        driver: impl FnOnce(&BusContext<'_>) -> Result<Box<dyn Driver>, BuildError>,
    ) -> Result<Rig, Error> {
        let mut parts = self.parts()?;
        let specs = &self.scenario().buses;
        let spec = specs.iter().find(|bus| bus.name.value == name);
        let bus = parts.buses.iter_mut().find(|bus| bus.name == name);
        let (Some(spec), Some(bus)) = (spec, bus) else {
            let known = specs.iter().map(|bus| bus.name.value.as_str());
            return Err(Error::no_such_bus(name, known));
        };
        let ports = &self.facts.process_ports;
        bus.driver = self.part_builder().built_bus(spec, ports, |context| {
            in_part(PartKind::Driver, context.name, || driver(context))
        })?;
        self.rig_of(parts, |plant| plant)
    }
}
