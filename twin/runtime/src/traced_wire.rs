use twinrig_kernel::SimTime;

use crate::{Part, PartKind, PlantAccess, TaskError, TrafficLog, Wire, in_part};

/// A wire with traces of the bytes between it and its host: `NAME/out` is written by the host,
/// `NAME/in` read by it; those of the wire follow.
pub(crate) struct TracedWire {
    /// Name of the bus.
    pub(crate) name: String,
    pub(crate) wire: Box<dyn Wire>,
    /// Bytes received last.
    pub(crate) received: Vec<u8>,
    traffic: TrafficLog,
}

/// Traces of a bus, before those of its wire.
const OUT: usize = 0;
const IN: usize = 1;
pub(crate) const OWN_TRACES: usize = 2;

impl TracedWire {
    pub(crate) fn new(name: String, wire: Box<dyn Wire>) -> Self {
        Self {
            name,
            wire,
            received: Vec::new(),
            traffic: TrafficLog::default(),
        }
    }

    /// Advances the wire to now.
    pub(crate) fn advance(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        in_part(PartKind::Wire, &self.name, || self.wire.advance(now, plant))
    }

    /// Advances the wire to now and reads the bytes that it has for the host; returns whether there
    /// are any.
    pub(crate) fn receive(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<bool, TaskError> {
        let (wire, received) = (&mut self.wire, &mut self.received);
        received.clear();
        in_part(PartKind::Wire, &self.name, || {
            wire.advance(now, plant)?;
            wire.receive(received);
            Ok::<_, TaskError>(())
        })?;
        self.traffic.record(IN, received);
        Ok(!received.is_empty())
    }

    /// Handles events of the wire that are not visible to the host ([`Wire::run_ahead`]).
    pub(crate) fn run_ahead(
        &mut self,
        now: SimTime,
        before: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<SimTime, TaskError> {
        in_part(PartKind::Wire, &self.name, || {
            self.wire.run_ahead(now, before, plant)
        })
    }

    /// Writes bytes of the host to the wire, which has been advanced to now.
    pub(crate) fn send(&mut self, bytes: &[u8], send: impl FnOnce(&mut dyn Wire, &[u8])) {
        in_part(PartKind::Wire, &self.name, || send(&mut *self.wire, bytes));
        self.traffic.record(OUT, bytes);
    }
}

impl Part for TracedWire {
    fn inner(&self) -> Option<&dyn Part> {
        Some(&*self.wire)
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Part> {
        Some(&mut *self.wire)
    }

    fn traces(&self) -> Vec<String> {
        byte_traces(&self.name, &self.wire.traces())
    }

    fn drain_traffic(&mut self, passed: &mut dyn FnMut(usize, &[u8])) {
        self.traffic.drain(passed);
        self.wire
            .drain_traffic(&mut |trace, bytes| passed(OWN_TRACES + trace, bytes));
    }
}

/// Returns the names of the traces of the bus `name`, with those of its wire.
pub(crate) fn byte_traces(name: &str, wire: &[String]) -> Vec<String> {
    ["out", "in"]
        .into_iter()
        .chain(wire.iter().map(String::as_str))
        .map(|trace| format!("{name}/{trace}"))
        .collect()
}
