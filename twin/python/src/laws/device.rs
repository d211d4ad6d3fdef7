//! Python objects as emulated devices.

use std::ops::Range;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use twinrig::bus::{Node, Piece};
use twinrig::kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig::runtime::{Part, PlantAccess, PlantSignals, TaskError, WiringError};

use super::values::read;
use crate::exceptions::Exceptions;
use crate::part::{self, Source};
use crate::part_objects::PartObjects;

/// Methods of a device.
pub(super) const METHODS: &[&str] = &["receive", "next_wake", "advance", "poll_transmit"];

/// Transmissions at one instant, beyond which there is no end.
const TRANSMISSIONS_MAX: u32 = 1000;

/// A Python object as device on a bus.
pub(super) struct PyDevice {
    name: String,
    ports: Vec<Port>,
    object: part::Part,
    /// Places in the plant of the inputs and of the outputs.
    inputs: Vec<Range<usize>>,
    outputs: Vec<Range<usize>>,
    now: SimTime,
    /// Number of transmissions at this instant.
    transmissions: u32,
}

impl PyDevice {
    pub(super) fn new(
        py: Python<'_>,
        source: &Source,
        (exceptions, objects): (&Exceptions, &PartObjects),
    ) -> PyResult<Self> {
        let object = source.object(py)?;
        let ports = part::ports(&object)?;
        Ok(Self {
            name: read(&object.getattr("name")?, "name", "a string")?,
            object: part::Part::new(&object, &ports, exceptions, objects),
            ports,
            inputs: Vec::new(),
            outputs: Vec::new(),
            now: SimTime::ZERO,
            transmissions: 0,
        })
    }
}

/// Returns whether a time \[ns\] is now or in the next hour: later ones are mistakes of the unit.
fn within_an_hour(now: SimTime, nanos: u64) -> bool {
    let hour = SimDuration::from_secs(3600);
    (now..=now + hour).contains(&SimTime::from_nanos(nanos))
}

impl Part for PyDevice {
    fn connect(&mut self, _: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.inputs.clear();
        self.outputs.clear();
        for port in &self.ports {
            let place = plant.find(&self.name, port)?;
            match port.direction {
                Direction::Input => self.inputs.push(place),
                Direction::Output => self.outputs.push(place),
            }
        }
        Ok(())
    }

    fn save(&self) -> Snapshot {
        self.object.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.object.restore(snapshot)
    }
}

impl Node for PyDevice {
    fn name(&self) -> &str {
        &self.name
    }

    fn receive(&mut self, piece: Piece<'_>) {
        self.object.call(|object| {
            let bytes = PyBytes::new(object.py(), piece.bytes);
            let times = (piece.first.as_nanos(), piece.spacing.as_nanos());
            let arguments = (times.0, times.1, bytes, piece.framing_error);
            object.call_method1("receive", arguments).map(|_| ())
        });
    }

    /// The device may react to each byte.
    fn min_bytes_needed(&self) -> Option<usize> {
        Some(1)
    }

    fn next_wake(&self) -> Option<SimTime> {
        let at: Option<u64> = self.object.call(|object| {
            let at = object.call_method0("next_wake")?;
            read(&at, "next_wake()", "whole nanoseconds or None")
        });
        at.map(SimTime::from_nanos)
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        (self.now, self.transmissions) = (now, 0);
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for place in &self.inputs {
            inputs.extend(plant.sample(place.clone())?);
        }
        for place in &self.outputs {
            outputs.extend(&*plant.actuate(place.clone())?);
        }
        self.object.call(|object| {
            let inputs = self.object.inputs(object.py(), &inputs)?;
            let array = self.object.outputs(object.py(), &outputs)?;
            let arguments = (now.as_nanos(), inputs, &array);
            let result = object.call_method1("advance", arguments)?;
            part::returns_nothing(&result, "advance")?;
            part::copied(&array, &mut outputs)
        });
        let mut rest = &outputs[..];
        for place in &self.outputs {
            let (values, after) = rest.split_at(place.len());
            plant.actuate(place.clone())?.copy_from_slice(values);
            rest = after;
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.transmissions += 1;
        let next: Option<(u64, Vec<u8>)> = self.object.call(|object| {
            let next = object.call_method0("poll_transmit")?;
            let next = read(&next, "poll_transmit()", "(start, bytes), in ns, or None")?;
            match next {
                Some((start, _)) if !within_an_hour(self.now, start) => {
                    let now = self.now.as_nanos();
                    Err(PyValueError::new_err(format!(
                        "`poll_transmit()` starts a transmission at {start} ns, and it is {now} ns"
                    )))
                }
                Some(_) if self.transmissions > TRANSMISSIONS_MAX => Err(PyRuntimeError::new_err(
                    "`poll_transmit()` returns transmissions without end: it removes each one",
                )),
                next => Ok(next),
            }
        });
        let (start, next) = next.filter(|(_, next)| !next.is_empty())?;
        bytes.extend(next);
        Some(SimTime::from_nanos(start))
    }
}
