//! Variables of an FMU: one table for model descriptions and instances.

use std::collections::BTreeSet;
use std::ops::Bound;

use twinrig_kernel::signal::magnitude_max;
use twinrig_kernel::{Layout, Unit};
use twinrig_runtime::{Group, ProcessVariable};

/// Name of the output with the fingerprint of a rig.
pub(crate) const FINGERPRINT: &str = "fingerprint";
/// Name of the independent variable.
pub(crate) const TIME: &str = "time";
/// Value reference of the independent variable.
pub(crate) const TIME_REFERENCE: u32 = 0;

/// A signal of an FMU: one or several elements. In FMI 3.0 it is one variable, in FMI 2.0 a
/// variable an element.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FmuVariable {
    /// Name of the signal.
    pub(crate) name: String,
    /// Meaning.
    pub(crate) description: String,
    /// Unit of every element.
    pub(crate) unit: Unit,
    /// Value reference of the first element, and of the whole; those of the others follow.
    pub(crate) reference: u32,
    /// Number of elements.
    pub(crate) size: usize,
    /// Start values; none for outputs.
    pub(crate) start: Option<Vec<f64>>,
    /// Least and greatest value of an input.
    pub(crate) range: (Option<f64>, Option<f64>),
    /// Whether the variable changes at instants only, not continuously.
    pub(crate) is_discrete: bool,
    /// Whether the value of an output at the start depends on inputs.
    pub(crate) depends_at_start: bool,
}

/// Place of an element in the instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Element {
    /// The independent variable.
    Time,
    /// Index of an input.
    Input(usize),
    /// Group and index of an output.
    Output(Group, usize),
}

/// The variables of an FMU.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variables {
    list: Vec<FmuVariable>,
    /// Elements by value reference; the first is time.
    elements: Vec<Element>,
    /// Index of the variable of each element but time.
    owners: Vec<usize>,
    names: BTreeSet<String>,
    has_fingerprint: bool,
}

impl FmuVariable {
    /// Returns whether the variable is an input.
    pub(crate) fn is_input(&self) -> bool {
        self.start.is_some()
    }

    /// Returns the names of the elements: of a vector `body/position[0]`, `body/position[1]`, ….
    pub(crate) fn element_names(&self) -> impl Iterator<Item = String> {
        (0..self.size).map(|n| match self.size {
            1 => self.name.clone(),
            _ => format!("{}[{n}]", self.name),
        })
    }

    /// Returns the value references of the elements.
    pub(crate) fn references(&self) -> impl Iterator<Item = u32> + use<> {
        let size = u32::try_from(self.size).unwrap_or(u32::MAX);
        self.reference..self.reference.saturating_add(size)
    }
}

impl Variables {
    /// Creates the table of an FMU without signals.
    pub(crate) fn new() -> Self {
        Self {
            elements: vec![Element::Time],
            // A signal of one of these names has no place.
            names: [TIME, FINGERPRINT].map(str::to_owned).into(),
            ..Self::default()
        }
    }

    /// Adds the inputs of a plant with their initial values, concatenated.
    pub(crate) fn add_commands(&mut self, layout: &Layout, start: &[f64]) {
        for field in layout.fields() {
            let most = magnitude_max(&field.port);
            let inputs = field.range().map(Element::Input).collect();
            self.add(inputs, |reference| FmuVariable {
                name: field.port.name.clone(),
                description: "command of the plant".to_owned(),
                unit: field.port.unit,
                reference,
                size: field.port.size,
                start: Some(start[field.range()].to_vec()),
                range: (most.map(|most| -most), most),
                is_discrete: false,
                depends_at_start: false,
            });
        }
    }

    /// Adds the process variables of a controller.
    pub(crate) fn add_process_variables(&mut self, process: &str, variables: &[ProcessVariable]) {
        for (index, variable) in variables.iter().enumerate() {
            let (min, max) = variable.range();
            let range = variable.range_text();
            self.add(vec![Element::Input(index)], |reference| FmuVariable {
                name: variable.name().to_owned(),
                description: format!("process variable of the controller {process}, in {range}"),
                unit: variable.unit(),
                reference,
                size: 1,
                start: Some(vec![variable.value()]),
                range: (least(min), greatest(max)),
                is_discrete: true,
                depends_at_start: false,
            });
        }
    }

    /// Adds the outputs of a group.
    pub(crate) fn add_outputs(&mut self, group: Group, layout: &Layout) {
        let (description, is_discrete) = match group {
            Group::Plant => ("output of the plant", false),
            Group::ProcessInputs => ("input of the controller", true),
            Group::ProcessOutputs => ("output of the controller", true),
            Group::Diagnostics => ("counter of a driver or a board", true),
        };
        for field in layout.fields() {
            let outputs = field.range().map(|index| Element::Output(group, index));
            self.add(outputs.collect(), |reference| FmuVariable {
                name: field.port.name.clone(),
                description: description.to_owned(),
                unit: field.port.unit,
                reference,
                size: field.port.size,
                start: None,
                range: (None, None),
                is_discrete,
                // The first iteration of the controller is at the start.
                depends_at_start: group == Group::ProcessOutputs,
            });
        }
    }

    /// Adds the output with the fingerprint, the last variable.
    pub(crate) fn add_fingerprint(&mut self) {
        self.has_fingerprint = true;
    }

    /// Adds a variable, unless the name of one of its elements is taken.
    fn add(&mut self, elements: Vec<Element>, variable: impl FnOnce(u32) -> FmuVariable) {
        let Ok(reference) = u32::try_from(self.elements.len()) else {
            return;
        };
        let variable = variable(reference);
        let names: Vec<String> = variable.element_names().collect();
        let is_taken = |name: &String| self.names.contains(name);
        if elements.is_empty() || is_taken(&variable.name) || names.iter().any(is_taken) {
            return;
        }
        self.names.extend(names);
        self.names.insert(variable.name.clone());
        self.owners.extend(elements.iter().map(|_| self.list.len()));
        self.elements.extend(elements);
        self.list.push(variable);
    }

    /// Returns the signals, inputs first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &FmuVariable> {
        self.list.iter()
    }

    /// Returns the inputs.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = &FmuVariable> {
        self.iter().filter(|variable| variable.is_input())
    }

    /// Returns the outputs, without the fingerprint.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = &FmuVariable> {
        self.iter().filter(|variable| !variable.is_input())
    }

    /// Returns the value reference of the fingerprint, if there is one.
    pub(crate) fn fingerprint(&self) -> Option<u32> {
        let next = u32::try_from(self.elements.len()).ok();
        next.filter(|_| self.has_fingerprint)
    }

    /// Returns the element of a value reference.
    pub(crate) fn element(&self, reference: u32) -> Option<Element> {
        self.elements.get(usize::try_from(reference).ok()?).copied()
    }

    /// Returns the variable that has an element of this value reference.
    pub(crate) fn owner(&self, reference: u32) -> Option<&FmuVariable> {
        let index = usize::try_from(reference).ok()?.checked_sub(1)?;
        self.list.get(*self.owners.get(index)?)
    }

    /// Returns the number of elements of the variable with this value reference as a whole.
    pub(crate) fn size(&self, reference: u32) -> Option<usize> {
        if reference == TIME_REFERENCE {
            return Some(1);
        }
        let owner = self.owner(reference)?;
        (owner.reference == reference).then_some(owner.size)
    }
}

/// Returns the least number within a lower bound.
fn least(bound: Bound<f64>) -> Option<f64> {
    finite(bound, f64::next_up)
}

/// Returns the greatest number within an upper bound.
fn greatest(bound: Bound<f64>) -> Option<f64> {
    finite(bound, f64::next_down)
}

fn finite(bound: Bound<f64>, inwards: fn(f64) -> f64) -> Option<f64> {
    let value = match bound {
        Bound::Included(value) => value,
        Bound::Excluded(value) => inwards(value),
        Bound::Unbounded => return None,
    };
    Some(value).filter(|value| value.is_finite())
}
