//! The parts of a build together with those of Python.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use twinrig::Registry;

use crate::errors::Failure;
use crate::exceptions::Exceptions;
use crate::part_objects::PartObjects;
use crate::{controller, plant, registry};

/// The standard registry with Python objects as further controllers and plants, and the place of
/// their exceptions.
pub(crate) struct PythonParts {
    pub(crate) registry: Registry,
    pub(crate) exceptions: Exceptions,
    /// Objects of the parts that have been built.
    pub(crate) objects: PartObjects,
    /// Whether there are any.
    pub(crate) any: bool,
}

impl PythonParts {
    /// Returns the registry with these parts by name.
    pub(crate) fn new(
        controllers: &Bound<'_, PyDict>,
        plants: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let (exceptions, objects) = (Exceptions::default(), PartObjects::default());
        let mut registry = registry::registry(&exceptions);
        for (name, given) in controllers {
            let kind = controller::kind(name.extract()?, &given, &exceptions, &objects)?;
            registry = registry.with_controller(kind);
        }
        for (name, given) in plants {
            registry =
                registry.with_plant(plant::kind(name.extract()?, &given, &exceptions, &objects)?);
        }
        Ok(Self {
            registry,
            exceptions,
            objects,
            any: !controllers.is_empty() || !plants.is_empty(),
        })
    }

    /// Returns the exception of a Python part, if it caused the failure, and else that of the
    /// failure.
    pub(crate) fn raised(&self, py: Python<'_>, failure: &Failure) -> PyErr {
        let exception = self.exceptions.take();
        exception.unwrap_or_else(|| failure.raised(py))
    }
}
