//! Python objects as drivers.

use std::cell::OnceCell;

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use twinrig::kernel::{
    Direction, HostTime, Layout, Port, SimDuration, Snapshot, SnapshotError, Unit,
};
use twinrig::runtime::{Driver, DriverError};
use twinrig_testing::laws::Traffic;

use super::values::{duration, read};
use crate::exceptions::Exceptions;
use crate::part::{self, Part, Source};
use crate::part_objects::PartObjects;

/// Methods of a driver.
pub(super) const METHODS: &[&str] = &[
    "open",
    "begin",
    "close",
    "handle_bytes",
    "handle_timeout",
    "poll_timeout",
    "poll_transmit",
    "is_busy",
    "traffic",
];

/// Counters of the traffic, as diagnostics, so that all laws compare them.
const COUNTERS: [&str; 3] = ["accepted", "missing", "discarded"];

/// A Python object as driver.
pub(super) struct PyDriver {
    name: String,
    ports: Vec<Port>,
    period: Option<SimDuration>,
    object: Part,
    /// Number of output values, and these as they were read after the last change.
    count: usize,
    values: OnceCell<Vec<f64>>,
}

impl PyDriver {
    pub(super) fn new(
        py: Python<'_>,
        source: &Source,
        (exceptions, objects): (&Exceptions, &PartObjects),
    ) -> PyResult<Self> {
        let object = source.object(py)?;
        let ports = part::ports(&object)?;
        let period = match part::attribute_or_call(&object, "period")? {
            Some(period) => duration(&period, "period")?,
            None => None,
        };
        Ok(Self {
            name: read(&object.getattr("name")?, "name", "a string")?,
            period,
            object: Part::new(&object, &ports, exceptions, objects),
            count: Layout::of(&ports, Direction::Output).len(),
            ports,
            values: OnceCell::new(),
        })
    }

    /// Returns a driver without an object, in place of one that could not be made: the exception of
    /// that is kept, so that nothing is called.
    pub(super) fn missing(
        py: Python<'_>,
        (exceptions, objects): (&Exceptions, &PartObjects),
    ) -> Self {
        Self {
            name: String::new(),
            ports: Vec::new(),
            period: None,
            object: Part::new(py.None().bind(py), &[], exceptions, objects),
            count: 0,
            values: OnceCell::new(),
        }
    }

    /// Returns the traffic that the driver has counted.
    pub(super) fn traffic(&self) -> Traffic {
        let counts = self.object.call(|object| {
            let counts = object.call_method0("traffic")?;
            read(
                &counts,
                "traffic()",
                "three numbers of frames: accepted, missing, discarded",
            )
        });
        let (accepted, missing, discarded) = counts;
        Traffic {
            accepted,
            missing,
            discarded,
        }
    }

    /// Calls a method that may change the values.
    fn change<R: Default>(&mut self, call: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<R>) -> R {
        self.values.take();
        self.object.call(call)
    }
}

/// Drops what a method without result has returned.
fn nothing(_: Bound<'_, PyAny>) {}

impl Driver for PyDriver {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn open(&mut self, now: HostTime) {
        self.change(|object| object.call_method1("open", (now.as_nanos(),)).map(nothing));
    }

    fn begin(&mut self, now: HostTime, from_process: &[f64]) {
        let arguments = (now.as_nanos(), from_process.to_vec());
        self.change(|object| object.call_method1("begin", arguments).map(nothing));
    }

    fn close(&mut self, now: HostTime) {
        self.change(|object| object.call_method1("close", (now.as_nanos(),)).map(nothing));
    }

    fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
        self.change(|object| {
            let arguments = (now.as_nanos(), PyBytes::new(object.py(), bytes));
            object.call_method1("handle_bytes", arguments).map(nothing)
        });
    }

    fn handle_timeout(&mut self, now: HostTime) {
        let now = (now.as_nanos(),);
        self.change(|object| object.call_method1("handle_timeout", now).map(nothing));
    }

    fn poll_timeout(&self) -> Option<HostTime> {
        let at: Option<u64> = self.object.call(|object| {
            let at = object.call_method0("poll_timeout")?;
            read(&at, "poll_timeout()", "whole nanoseconds or None")
        });
        at.map(HostTime::from_nanos)
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
        let next: Option<Vec<u8>> = self.change(|object| {
            let next = object.call_method0("poll_transmit")?;
            read(&next, "poll_transmit()", "bytes or None")
        });
        let next = next.unwrap_or_default();
        bytes.extend(&next);
        !next.is_empty()
    }

    fn is_busy(&self) -> Result<bool, DriverError> {
        let busy = self
            .object
            .call(|object| match object.call_method0("is_busy") {
                Ok(busy) => Ok(Some(Ok(read(&busy, "is_busy()", "a bool")?))),
                // The devices have failed, and not the driver.
                Err(error) if error.is_instance_of::<PyOSError>(object.py()) => {
                    let why = error.value(object.py()).str()?.to_string();
                    Ok(Some(Err(DriverError { why })))
                }
                Err(error) => Err(error),
            });
        busy.unwrap_or_else(|| {
            let why = "an exception".to_owned();
            Err(DriverError { why })
        })
    }

    fn to_process(&self) -> &[f64] {
        self.values.get_or_init(|| {
            let values = self.object.call(|object| {
                let values = part::attribute_or_call(object, "values")?;
                let values = values.unwrap_or_else(|| object.py().None().into_bound(object.py()));
                let values: Vec<f64> = read(&values, "values", "numbers, those of all outputs")?;
                if values.len() == self.count {
                    return Ok(Some(values));
                }
                let (found, expected) = (values.len(), self.count);
                Err(PyValueError::new_err(format!(
                    "`values` has {found} numbers, the outputs in `ports` have {expected}"
                )))
            });
            values.unwrap_or_else(|| vec![0.0; self.count])
        })
    }

    fn diagnostics(&self) -> Vec<Port> {
        let name = |counter| format!("{}/{counter}", self.name);
        COUNTERS
            .map(|counter| Port::output(name(counter), Unit::One, 1))
            .into()
    }

    fn read_diagnostics(&self, values: &mut [f64]) {
        let Traffic {
            accepted,
            missing,
            discarded,
        } = self.traffic();
        for (value, count) in values.iter_mut().zip([accepted, missing, discarded]) {
            *value = count as f64;
        }
    }

    fn period(&self) -> Option<SimDuration> {
        self.period
    }

    fn save(&self) -> Snapshot {
        self.object.save()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.values.take();
        self.object.restore(snapshot)
    }
}
