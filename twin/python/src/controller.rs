//! Python objects as processes.

use std::ops::{Bound as RangeBound, RangeBounds};
use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use twinrig::kernel::{Port, SimDuration, Snapshot, SnapshotError};
use twinrig::runtime::{Process, ProcessVariable, VariableError};
use twinrig::{BuildError, ControllerKind};

use crate::exceptions::Exceptions;
use crate::part::{self, Part, Source};
use crate::part_objects::{PartObjects, SharedObject};

/// Returns the kind of controller `name` that is made of Python objects.
///
/// # Errors
/// An exception of the object, or variables that are not valid.
pub(crate) fn kind(
    name: String,
    given: &Bound<'_, PyAny>,
    exceptions: &Exceptions,
    objects: &PartObjects,
) -> PyResult<ControllerKind> {
    let source = Arc::new(Source::new(given, &["step"]));
    let variables = variables(&source.object(given.py())?)?;
    let (exceptions, objects) = (exceptions.clone(), objects.clone());
    let build = {
        let (name, variables) = (name.clone(), variables.clone());
        move || -> Result<PyProcess, BuildError> {
            let built = Python::attach(|py| {
                let object = source.object(py);
                let built = object.and_then(|object| {
                    PyProcess::new(&name, &object, variables.clone(), &exceptions, &objects)
                });
                built.map_err(|exception| exceptions.keep(py, exception))
            });
            Ok(built?)
        }
    };
    let of_legs = build.clone();
    Ok(
        ControllerKind::new(name, "a Python object", move |_| build())
            .or_without_robot(move |_| of_legs())
            .with_variables(move |_| Ok(variables.clone())),
    )
}

/// Returns the attribute `variables` of a controller: objects with `name`, `unit`, `default`, and
/// `min` and `max` or None, such as `twinrig.Variable`.
fn variables(object: &Bound<'_, PyAny>) -> PyResult<Vec<ProcessVariable>> {
    let items = part::items(object, "variables")?;
    items.iter().map(to_variable).collect()
}

fn to_variable(variable: &Bound<'_, PyAny>) -> PyResult<ProcessVariable> {
    let name: String = variable.getattr("name")?.extract()?;
    let unit = part::unit(&variable.getattr("unit")?.extract::<String>()?)?;
    let default: f64 = variable.getattr("default")?.extract()?;
    let bound = |name| -> PyResult<RangeBound<f64>> {
        let value: Option<f64> = variable.getattr(name)?.extract()?;
        Ok(value.map_or(RangeBound::Unbounded, RangeBound::Included))
    };
    let (min, max) = (bound("min")?, bound("max")?);
    if !default.is_finite() || !(min, max).contains(&default) {
        return Err(PyValueError::new_err(format!(
            "the default of the variable `{name}`, {default}, is not in its range"
        )));
    }
    Ok(ProcessVariable::new(name, unit, (min, max), default))
}

/// A Python object as process.
struct PyProcess {
    name: String,
    ports: Vec<Port>,
    variables: Vec<ProcessVariable>,
    part: Part,
    step: SharedObject,
    fault: Option<String>,
}

impl PyProcess {
    fn new(
        name: &str,
        object: &Bound<'_, PyAny>,
        variables: Vec<ProcessVariable>,
        exceptions: &Exceptions,
        objects: &PartObjects,
    ) -> PyResult<Self> {
        let ports = part::ports(object)?;
        for variable in &variables {
            set_attribute(object, variable.name(), variable.value())?;
        }
        Ok(Self {
            name: name.to_owned(),
            part: Part::new(object, &ports, exceptions, objects),
            step: objects.share(object.getattr("step")?.unbind()),
            ports,
            variables,
            fault: None,
        })
    }

    fn iterate(
        &self,
        elapsed: SimDuration,
        inputs: &[f64],
        outputs: &mut [f64],
    ) -> Result<(), String> {
        self.part.attached(|py| {
            let inputs = self.part.inputs(py, inputs)?;
            let array = self.part.outputs(py, outputs)?;
            let result = self
                .step
                .bind(py)
                .call1((elapsed.as_secs_f64(), inputs, &array))?;
            part::returns_nothing(&result, "step")?;
            part::copied(&array, outputs)
        })
    }
}

/// Sets a variable of a controller: by its method `set_variable`, or as its attribute.
fn set_attribute(object: &Bound<'_, PyAny>, name: &str, value: f64) -> PyResult<()> {
    match object.getattr_opt(intern!(object.py(), "set_variable"))? {
        Some(set) => set.call1((name, value)).map(|_| ()),
        None => object.setattr(name, value),
    }
}

impl Process for PyProcess {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.variables
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let count = self.variables.len();
        let variable = self.variables.get_mut(index);
        let variable = variable.ok_or(VariableError::NoSuchIndex { index, count })?;
        variable.check(value)?;
        let object = &self.part.object;
        let set = self
            .part
            .attached(|py| set_attribute(object.bind(py), variable.name(), value));
        set.map_err(|why| VariableError::Refused {
            name: variable.name().to_owned(),
            value,
            why,
        })?;
        variable.set(value)
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.fault = self.iterate(elapsed, inputs, outputs).err();
    }

    fn fault(&self) -> Option<String> {
        self.fault.clone()
    }

    fn save(&self) -> Snapshot {
        let values: Vec<f64> = self.variables.iter().map(ProcessVariable::value).collect();
        Snapshot::of(&(values, self.part.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (values, state): (Vec<f64>, Snapshot) = snapshot.read()?;
        self.part.restore(&state)?;
        for (variable, value) in self.variables.iter_mut().zip(values) {
            let set = variable.set(value);
            set.map_err(|error| SnapshotError::Mismatch {
                expected: format!("a controller with the variable `{}`", variable.name()),
                found: error.to_string(),
            })?;
        }
        self.fault = None;
        Ok(())
    }
}
