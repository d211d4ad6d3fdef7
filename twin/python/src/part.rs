//! Common to Python objects that are parts of a rig: their ports, their state and the arrays that
//! they read and write.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use twinrig::kernel::{Direction, Layout, Port, Snapshot, SnapshotError, Unit};

use crate::exceptions::Exceptions;
use crate::part_objects::{PartObjects, SharedObject};

/// Source of a part: a class or another callable, which is called for every rig, or an object with
/// its methods, of which every rig gets a deep copy. So no run depends on an earlier one.
pub(crate) struct Source {
    given: Py<PyAny>,
    methods: &'static [&'static str],
}

impl Source {
    /// Returns the source of parts with methods of these names.
    pub(crate) fn new(given: &Bound<'_, PyAny>, methods: &'static [&'static str]) -> Self {
        Self {
            given: given.clone().unbind(),
            methods,
        }
    }

    /// Returns a new object for a rig.
    pub(crate) fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let given = self.given.bind(py);
        let is_class = given.is_instance_of::<pyo3::types::PyType>();
        let has = |method: &&str| given.hasattr(*method);
        let is_part = || self.methods.first().map_or(Ok(true), has);
        if is_class || (given.is_callable() && !is_part()?) {
            let object = given.call0()?;
            return self.checked(object);
        }
        self.checked(given.clone())?;
        py.import("copy")?.call_method1("deepcopy", (given,))
    }

    fn checked<'py>(&self, object: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        for name in self.methods {
            let method = object.getattr_opt(*name)?;
            if !method.is_some_and(|method| method.is_callable()) {
                let kind = object.get_type().name()?;
                let message = format!("{kind} has no method `{name}`");
                return Err(PyTypeError::new_err(message));
            }
        }
        Ok(object)
    }
}

/// Returns the attribute `ports` of a part, a list or a method that returns one: objects with
/// `name`, `unit`, `size` and `direction`, such as `twinrig.Input` and `twinrig.Output`.
pub(crate) fn ports(object: &Bound<'_, PyAny>) -> PyResult<Vec<Port>> {
    let ports = attribute_or_call(object, "ports")?;
    let ports = ports.ok_or_else(|| PyTypeError::new_err("the part has no attribute `ports`"))?;
    ports.try_iter()?.map(|port| to_port(&port?)).collect()
}

/// Returns the value of an attribute, or of the method of that name without arguments.
pub(crate) fn attribute_or_call<'py>(
    object: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    match object.getattr_opt(name)? {
        Some(value) if value.is_callable() => value.call0().map(Some),
        value => Ok(value),
    }
}

fn to_port(port: &Bound<'_, PyAny>) -> PyResult<Port> {
    let name: String = port.getattr("name")?.extract()?;
    let unit = unit(&port.getattr("unit")?.extract::<String>()?)?;
    let size: usize = port.getattr("size")?.extract()?;
    match port.getattr("direction")?.extract::<String>()?.as_str() {
        "input" => Ok(Port::input(name, unit, size)),
        "output" => Ok(Port::output(name, unit, size)),
        other => Err(PyValueError::new_err(format!(
            "the direction of port `{name}` is `{other}`, which is neither `input` nor `output`"
        ))),
    }
}

/// Returns the unit with that symbol.
pub(crate) fn unit(symbol: &str) -> PyResult<Unit> {
    let found = Unit::ALL.iter().find(|unit| unit.symbol() == symbol);
    found.copied().ok_or_else(|| {
        let known: Vec<&str> = Unit::ALL.iter().map(|unit| unit.symbol()).collect();
        PyValueError::new_err(format!(
            "there is no unit `{symbol}`; units are {}",
            known.join(", ")
        ))
    })
}

/// An object with the arrays of its inputs and outputs, which are the same in every call.
pub(crate) struct Part {
    pub(crate) object: SharedObject,
    inputs: Py<PyArray1<f64>>,
    outputs: Py<PyArray1<f64>>,
    exceptions: Exceptions,
}

impl Part {
    pub(crate) fn new(
        object: &Bound<'_, PyAny>,
        ports: &[Port],
        exceptions: &Exceptions,
        objects: &PartObjects,
    ) -> Self {
        let py = object.py();
        let zeros = |direction| {
            let len = Layout::of(ports, direction).len();
            PyArray1::zeros(py, len, false).unbind()
        };
        Self {
            object: objects.share(object.clone().unbind()),
            inputs: zeros(Direction::Input),
            outputs: zeros(Direction::Output),
            exceptions: exceptions.clone(),
        }
    }

    /// Attaches to the interpreter for `call`; keeps its exception and returns the text of it.
    pub(crate) fn attached<R>(
        &self,
        call: impl FnOnce(Python<'_>) -> PyResult<R>,
    ) -> Result<R, String> {
        Python::attach(|py| call(py).map_err(|exception| self.exceptions.keep(py, exception)))
    }

    /// Calls the object, unless one of the parts that share the exceptions has raised one; keeps an
    /// exception of the call. Returns the default where there is no result.
    pub(crate) fn call<R: Default>(
        &self,
        call: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<R>,
    ) -> R {
        if self.exceptions.any() {
            return R::default();
        }
        let called = self.attached(|py| call(self.object.bind(py)));
        called.unwrap_or_default()
    }

    /// Returns the array of inputs with these values.
    pub(crate) fn inputs<'py>(
        &self,
        py: Python<'py>,
        values: &[f64],
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        filled(self.inputs.bind(py), values)
    }

    /// Returns the array of outputs with these values.
    pub(crate) fn outputs<'py>(
        &self,
        py: Python<'py>,
        values: &[f64],
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        filled(self.outputs.bind(py), values)
    }

    /// Saves the state of the object: the bytes that its method `save` returns, or by default its
    /// attributes, pickled. A failure is reported by the call that runs the part.
    pub(crate) fn save(&self) -> Snapshot {
        let saved = self.attached(|py| {
            let object = self.object.bind(py);
            let bytes = if let Some(save) = object.getattr_opt(intern!(py, "save"))? {
                save.call0()?
            } else {
                let attributes = attributes(object)?;
                py.import("pickle")?.call_method1("dumps", (attributes,))?
            };
            Ok(bytes.cast::<PyBytes>()?.as_bytes().to_vec())
        });
        Snapshot(saved.unwrap_or_default())
    }

    /// Restores what [`Part::save`] has saved: by the method `restore`, or by default by
    /// replacing the attributes of the object.
    pub(crate) fn restore(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let restored = self.attached(|py| {
            let object = self.object.bind(py);
            let bytes = PyBytes::new(py, &snapshot.0);
            if let Some(restore) = object.getattr_opt(intern!(py, "restore"))? {
                return restore.call1((bytes,)).map(|_| ());
            }
            let saved = py.import("pickle")?.call_method1("loads", (bytes,))?;
            let attributes = attributes(object)?;
            attributes.clear();
            attributes.update(saved.cast::<PyDict>()?.as_mapping())
        });
        restored.map_err(|why| SnapshotError::Decode {
            state: "Python object",
            why,
        })
    }
}

/// Returns the attributes of an object.
fn attributes<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let none = || {
        PyTypeError::new_err(
            "the part has no attributes that could be saved: define its methods `save` and `restore`",
        )
    };
    let attributes = object.getattr_opt("__dict__")?.ok_or_else(none)?;
    Ok(attributes.cast_into::<PyDict>()?)
}

fn filled<'py>(
    array: &Bound<'py, PyArray1<f64>>,
    values: &[f64],
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let mut writable = array.try_readwrite().map_err(changed)?;
    let slice = writable.as_slice_mut().map_err(changed)?;
    if slice.len() != values.len() {
        return Err(changed("another size"));
    }
    slice.copy_from_slice(values);
    Ok(array.clone())
}

/// Copies the values of an array that Python has written.
pub(crate) fn copied(array: &Bound<'_, PyArray1<f64>>, values: &mut [f64]) -> PyResult<()> {
    let readable: PyReadonlyArray1<'_, f64> = array.try_readonly().map_err(changed)?;
    let slice = readable.as_slice().map_err(changed)?;
    if slice.len() != values.len() {
        return Err(changed("another size"));
    }
    values.copy_from_slice(slice);
    Ok(())
}

/// The error for an array that the part has made unusable.
fn changed(why: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(format!(
        "the arrays of inputs and outputs belong to the rig: write their elements only ({why})"
    ))
}

/// Refuses a value returned by a method that writes its results in place.
pub(crate) fn returns_nothing(result: &Bound<'_, PyAny>, method: &str) -> PyResult<()> {
    if result.is_none() {
        return Ok(());
    }
    Err(PyTypeError::new_err(format!(
        "`{method}` returned a value: it writes into its last argument and returns None"
    )))
}

/// Returns the items of the optional attribute `name`.
pub(crate) fn items<'py>(
    object: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let items = attribute_or_call(object, name)?;
    let items = items.unwrap_or_else(|| PyList::empty(object.py()).into_any());
    items.try_iter()?.collect()
}
