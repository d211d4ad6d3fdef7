//! Python objects as plants.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use twinrig::kernel::{
    Direction, Field, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError,
};
use twinrig::runtime::{Plant, PlantFault};
use twinrig::scenario::{LegFact, PlantSpec};
use twinrig::{BuildError, PlantKind, StandaloneModel};

use crate::exceptions::Exceptions;
use crate::part::{self, Part, Source};
use crate::part_objects::PartObjects;

/// Returns the kind of plant `name` that is made of Python objects.
///
/// # Errors
/// An exception of the object.
pub(crate) fn kind(
    name: String,
    given: &Bound<'_, PyAny>,
    exceptions: &Exceptions,
    objects: &PartObjects,
) -> PyResult<PlantKind> {
    let source = Arc::new(Source::new(given, &["advance"]));
    let ports = part::ports(&source.object(given.py())?)?;
    let model = Model {
        name: name.clone(),
        ports,
        source,
        exceptions: exceptions.clone(),
        objects: objects.clone(),
    };
    Ok(PlantKind::standalone(name, "a Python object", move |_| {
        Ok(model.clone())
    }))
}

/// Model of a plant that is a Python object.
#[derive(Clone)]
struct Model {
    name: String,
    ports: Vec<Port>,
    source: Arc<Source>,
    exceptions: Exceptions,
    objects: PartObjects,
}

impl StandaloneModel for Model {
    fn name(&self) -> &str {
        &self.name
    }

    fn legs(&self) -> Option<Vec<LegFact>> {
        None
    }

    fn weight(&self) -> Option<f64> {
        None
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn step(&self) -> Option<SimDuration> {
        None
    }

    fn files(&self) -> Vec<(String, Vec<u8>)> {
        Vec::new()
    }

    fn build(
        &self,
        _: &PlantSpec,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError> {
        let built = Python::attach(|py| {
            let object = self.source.object(py);
            let built = object.map(|object| PyPlant::new(self, &object, wanted));
            built.map_err(|exception| self.exceptions.keep(py, exception))
        });
        Ok(Box::new(built?))
    }
}

/// A Python object as plant. It computes all of its outputs; the rig gets those that it wants.
struct PyPlant {
    name: String,
    ports: Vec<Port>,
    part: Part,
    /// Layout of all outputs, their values, and the indices of the wanted ones.
    layout: Layout,
    outputs: Vec<f64>,
    wanted: Vec<usize>,
    now: SimTime,
    /// Failure of an observation, which the next advance reports.
    fault: Option<String>,
}

impl PyPlant {
    fn new(model: &Model, object: &Bound<'_, PyAny>, wanted: &dyn Fn(&str) -> bool) -> Self {
        let all = Layout::of(&model.ports, Direction::Output);
        let chosen = all.fields().filter(|field| wanted(&field.port.name));
        let is_port = |port: &&Port| port.direction == Direction::Input || wanted(&port.name);
        Self {
            name: model.name.clone(),
            ports: model.ports.iter().filter(is_port).cloned().collect(),
            part: Part::new(object, &model.ports, &model.exceptions, &model.objects),
            outputs: vec![0.0; all.len()],
            wanted: chosen.flat_map(Field::range).collect(),
            layout: all,
            now: SimTime::ZERO,
            fault: None,
        }
    }

    fn failed(&self, why: String) -> PlantFault {
        PlantFault {
            time: self.now,
            part: self.name.clone(),
            energy: 0.0,
            why,
        }
    }
}

/// Refuses an infinity or NaN among the outputs.
fn check_finite(layout: &Layout, outputs: &[f64]) -> PyResult<()> {
    let Some(index) = outputs.iter().position(|value| !value.is_finite()) else {
        return Ok(());
    };
    let name = layout.field_at(index).map_or("", |field| &field.port.name);
    Err(PyValueError::new_err(format!(
        "`observe` wrote {} to `{name}`",
        outputs[index]
    )))
}

impl Plant for PyPlant {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if let Some(why) = &self.fault {
            return Err(self.failed(why.clone()));
        }
        let advanced = self.part.attached(|py| {
            let inputs = self.part.inputs(py, inputs)?;
            let object = self.part.object.bind(py);
            let advance = intern!(py, "advance");
            let result = object.call_method1(advance, (to.as_secs_f64(), inputs))?;
            part::returns_nothing(&result, "advance")
        });
        advanced.map_err(|why| self.failed(why))?;
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let (part, layout) = (&self.part, &self.layout);
        let all = &mut self.outputs;
        let observed = part.attached(|py| {
            let array = part.outputs(py, all)?;
            let object = part.object.bind(py);
            let result = object.call_method1(intern!(py, "observe"), (&array,))?;
            part::returns_nothing(&result, "observe")?;
            part::copied(&array, all)?;
            check_finite(layout, all)
        });
        self.fault = observed.err();
        for (output, &index) in outputs.iter_mut().zip(&self.wanted) {
            *output = self.outputs[index];
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.now, &self.outputs, self.part.save()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (now, outputs, state): (SimTime, Vec<f64>, Snapshot) = snapshot.read()?;
        if outputs.len() != self.outputs.len() {
            return Err(SnapshotError::Mismatch {
                expected: format!("a plant of {} output values", self.outputs.len()),
                found: format!("one of {}", outputs.len()),
            });
        }
        self.part.restore(&state)?;
        (self.now, self.outputs, self.fault) = (now, outputs, None);
        Ok(())
    }
}
