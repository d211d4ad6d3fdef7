//! Setups of drivers and devices in Python.

use std::rc::Rc;

use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use twinrig::kernel::Port;
use twinrig::runtime::{Part, PlantSignals};
use twinrig_testing::laws::{Detection, DeviceSetup, Nodes};

use super::device::{self, PyDevice};
use super::driver::{self, PyDriver};
use super::values::{duration, read};
use crate::exceptions::Exceptions;
use crate::part::{self, Source};
use crate::part_objects::PartObjects;

/// Detections by their names.
const DETECTIONS: [(&str, Detection); 2] = [
    ("all damage", Detection::AllDamage),
    ("wrong bits", Detection::WrongBits),
];

/// Maker of a driver and its devices.
struct Maker {
    driver: Source,
    devices: Vec<Source>,
    exceptions: Exceptions,
    objects: PartObjects,
}

impl Maker {
    fn driver(&self, py: Python<'_>) -> PyResult<PyDriver> {
        PyDriver::new(py, &self.driver, (&self.exceptions, &self.objects))
    }

    fn devices(&self, py: Python<'_>) -> PyResult<Vec<PyDevice>> {
        let shared = (&self.exceptions, &self.objects);
        let devices = self.devices.iter();
        devices
            .map(|source| PyDevice::new(py, source, shared))
            .collect()
    }

    /// Returns a driver; a missing one if an exception, which is kept, prevents it.
    fn any_driver(&self) -> PyDriver {
        Python::attach(|py| {
            self.driver(py).unwrap_or_else(|exception| {
                self.exceptions.keep(py, exception);
                PyDriver::missing(py, (&self.exceptions, &self.objects))
            })
        })
    }

    fn nodes(&self) -> Nodes {
        Python::attach(|py| {
            let devices = self.devices(py).unwrap_or_else(|exception| {
                self.exceptions.keep(py, exception);
                Vec::new()
            });
            devices.into_iter().map(|it| Box::new(it) as _).collect()
        })
    }

    /// Makes both, and connects the devices to a plant with these ports.
    fn check(&self, py: Python<'_>, ports: &[Port]) -> PyResult<()> {
        let signals = PlantSignals::of(ports);
        self.driver(py)?;
        for mut device in self.devices(py)? {
            let connected = device.connect("laws", &signals);
            connected.map_err(|error| PyValueError::new_err(format!("devices: {error}")))?;
        }
        Ok(())
    }
}

/// Reads a `twinrig.laws.Setup`. Its driver and devices keep their exceptions in `exceptions`.
///
/// # Errors
/// An exception that names the argument, or that of the driver or a device.
pub(super) fn read_setup(
    setup: &Bound<'_, PyAny>,
    exceptions: &Exceptions,
) -> PyResult<DeviceSetup<PyDriver>> {
    let py = setup.py();
    let devices = part::items(setup, "devices")?;
    let maker = Rc::new(Maker {
        driver: Source::new(&setup.getattr("driver")?, driver::METHODS),
        devices: devices
            .iter()
            .map(|it| Source::new(it, device::METHODS))
            .collect(),
        exceptions: exceptions.clone(),
        objects: PartObjects::default(),
    });
    let ports = part::ports(setup)?;
    if devices.is_empty() {
        return Err(PyValueError::new_err("devices: there must be one"));
    }
    maker.check(py, &ports)?;
    let byte_time = duration(&setup.getattr("byte_time")?, "byte_time")?;
    let byte_time = byte_time.ok_or_else(|| PyTypeError::new_err("byte_time: None"))?;
    let for_nodes = maker.clone();
    let made = DeviceSetup::new(
        byte_time,
        ports,
        move || maker.any_driver(),
        move || for_nodes.nodes(),
    );
    let made = with_bounds(made.with_traffic(|driver, _| driver.traffic()), setup)?;
    with_line(with_signals(made, setup, exceptions)?, setup)
}

/// Adds the bounds that the driver promises; those that are None have their defaults.
fn with_bounds(
    mut made: DeviceSetup<PyDriver>,
    setup: &Bound<'_, PyAny>,
) -> PyResult<DeviceSetup<PyDriver>> {
    let time = |name| duration(&setup.getattr(name)?, name);
    if let Some(period) = time("period")? {
        made = made.with_period(period);
    }
    if let Some(deadline) = time("deadline")? {
        made = made.with_deadline(deadline);
    }
    if let Some(deadline) = time("transfer_deadline")? {
        made = made.with_transfer_deadline(deadline);
    }
    if let Some(periods) = value(setup, "recovery", "a number of periods")? {
        made = made.with_recovery(periods);
    }
    if let Some(bytes) = value(setup, "state_bytes", "a number of bytes")? {
        made = made.with_state_bytes(bytes);
    }
    Ok(made)
}

/// Adds the outputs of the plant and the commands.
fn with_signals(
    mut made: DeviceSetup<PyDriver>,
    setup: &Bound<'_, PyAny>,
    exceptions: &Exceptions,
) -> PyResult<DeviceSetup<PyDriver>> {
    if let Some(levels) = function(setup, "levels", exceptions)? {
        made = made.with_levels(levels);
    }
    if let Some(commands) = function(setup, "commands", exceptions)? {
        made = made.with_commands(commands);
    }
    Ok(made)
}

/// Adds properties of the protocol.
fn with_line(
    made: DeviceSetup<PyDriver>,
    setup: &Bound<'_, PyAny>,
) -> PyResult<DeviceSetup<PyDriver>> {
    let detection: String = read(&setup.getattr("detection")?, "detection", "a string")?;
    let found = DETECTIONS.into_iter().find(|(name, _)| *name == detection);
    let (_, detection) = found.ok_or_else(|| {
        let known = DETECTIONS.map(|(name, _)| name).join("`, `");
        PyValueError::new_err(format!("detection: `{detection}` is none of `{known}`"))
    })?;
    let spacing = value(setup, "spacing", "a number of bytes")?.unwrap_or(0);
    let foreign = read(
        &setup.getattr("foreign_frames")?,
        "foreign_frames",
        "frames: bytes",
    )?;
    let mut made = made
        .with_detection(detection, spacing)
        .with_foreign_frames(foreign);
    if read(
        &setup.getattr("numbered_answers")?,
        "numbered_answers",
        "a bool",
    )? {
        made = made.with_numbered_answers();
    }
    Ok(made)
}

/// Returns the attribute `name`, if it is not None.
fn value<'py, T: FromPyObjectOwned<'py>>(
    setup: &Bound<'py, PyAny>,
    name: &str,
    expected: &str,
) -> PyResult<Option<T>> {
    read(&setup.getattr(name)?, name, expected)
}

/// Returns the function of two numbers in the attribute `name`, if it is not None. It returns NaN
/// after an exception, which is kept.
fn function(
    setup: &Bound<'_, PyAny>,
    name: &'static str,
    exceptions: &Exceptions,
) -> PyResult<Option<impl Fn(usize, usize) -> f64 + use<>>> {
    let function = setup.getattr(name)?;
    if function.is_none() {
        return Ok(None);
    }
    if !function.is_callable() {
        let found = function.repr()?;
        let message = format!("`{name}` is {found}: expected a function of two numbers");
        return Err(PyTypeError::new_err(message));
    }
    let (function, exceptions) = (function.unbind(), exceptions.clone());
    Ok(Some(move |first: usize, second: usize| {
        Python::attach(|py| {
            let called = function.bind(py).call1((first, second));
            let number = called.and_then(|number| {
                read(&number, name, "a function of two numbers that returns one")
            });
            number.unwrap_or_else(|exception| {
                exceptions.keep(py, exception);
                f64::NAN
            })
        })
    }))
}
