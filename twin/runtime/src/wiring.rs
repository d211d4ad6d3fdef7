use std::fmt;
use std::ops::Range;

use thiserror::Error;
use twinrig_kernel::{Direction, Field, Layout, Port, near_misses};

use crate::Process;

/// A signal that does not connect. Signals connect by name: same name, opposite direction, same
/// size, same unit; an unmatched signal is an error.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WiringError {
    /// A signal has no counterpart.
    #[error(
        "nothing {} `{port}`, which {owner} {}{near}",
        counterpart_verb(port),
        owner_verb(port)
    )]
    Unmatched {
        /// The owner of the signal.
        owner: String,
        /// The signal, as declared by its owner.
        port: Port,
        /// Similar signals.
        near: NearMisses,
    },
    /// An input has more than one source.
    #[error("`{port}` of {owner} has two sources: {first} and {second}")]
    TwoSources {
        /// The owner of the input.
        owner: String,
        /// The input.
        port: Box<Port>,
        /// The first source.
        first: String,
        /// The second source.
        second: String,
    },
    /// A part has two ports of the same name and direction.
    #[error("{owner} has two {}s named `{}`", port.direction, port.name)]
    Twice {
        /// The part.
        owner: String,
        /// The second of them.
        port: Port,
    },
    /// Two tasks have the same name.
    #[error("two tasks are named `{name}`")]
    SameName {
        /// The name.
        name: String,
    },
}

/// Counterparts that nearly match: equal names with another size or unit, and similar names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NearMisses(pub Vec<Port>);

impl fmt::Display for NearMisses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, port) in self.0.iter().enumerate() {
            write!(f, "{}`{port}`", if n == 0 { "; there is " } else { ", " })?;
        }
        Ok(())
    }
}

fn counterpart_verb(port: &Port) -> &'static str {
    match port.direction {
        Direction::Input => "provides",
        Direction::Output => "takes",
    }
}

fn owner_verb(port: &Port) -> &'static str {
    match port.direction {
        Direction::Input => "reads",
        Direction::Output => "writes",
    }
}

/// Signals of the plant.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PlantSignals {
    /// Signals that can be actuated.
    pub inputs: Layout,
    /// Signals that can be sampled.
    pub outputs: Layout,
}

impl PlantSignals {
    /// Returns the signals of a plant with these ports.
    pub fn of(ports: &[Port]) -> Self {
        Self {
            inputs: Layout::of(ports, Direction::Input),
            outputs: Layout::of(ports, Direction::Output),
        }
    }

    /// Returns the range of the counterpart of `port` of `owner`: among the outputs if the owner
    /// reads it, among the inputs if the owner writes it.
    ///
    /// # Errors
    /// [`WiringError::Unmatched`] if there is no such signal, with similar ones.
    pub fn find(&self, owner: &str, port: &Port) -> Result<Range<usize>, WiringError> {
        let layout = match port.direction {
            Direction::Input => &self.outputs,
            Direction::Output => &self.inputs,
        };
        find(layout, owner, port)
    }
}

/// Returns the range of the counterpart of `port` in `layout`.
pub(crate) fn find(layout: &Layout, owner: &str, port: &Port) -> Result<Range<usize>, WiringError> {
    match layout.field(&port.name) {
        Some(field) if field.port.connects(port) => Ok(field.range()),
        _ => Err(unmatched(
            owner,
            port,
            layout.fields().map(|field| &field.port),
        )),
    }
}

/// Creates the error for a `port` that matches none of `others`.
pub(crate) fn unmatched<'a>(
    owner: &str,
    port: &Port,
    others: impl Iterator<Item = &'a Port>,
) -> WiringError {
    let others: Vec<&Port> = others.collect();
    let same_name = others.iter().filter(|other| other.name == port.name);
    let similar = near_misses(&port.name, others.iter().map(|other| other.name.as_str()));
    let named = similar
        .iter()
        .filter_map(|name| others.iter().find(|other| other.name == *name));
    let near = NearMisses(same_name.chain(named).map(|&other| other.clone()).collect());
    WiringError::Unmatched {
        owner: owner.into(),
        port: port.clone(),
        near,
    }
}

/// Checks that no two ports have the same name and direction.
pub(crate) fn check_names(owner: &str, ports: &[Port]) -> Result<(), WiringError> {
    for (n, port) in ports.iter().enumerate() {
        if ports[..n]
            .iter()
            .any(|p| p.name == port.name && p.direction == port.direction)
        {
            return Err(WiringError::Twice {
                owner: owner.into(),
                port: port.clone(),
            });
        }
    }
    Ok(())
}

/// Appends the diagnostics of a part to those of all parts, and returns the range of its values.
pub(crate) fn append_ports(all: &mut Vec<Port>, ports: Vec<Port>) -> Range<usize> {
    let before = Layout::of(&*all, Direction::Output).len();
    all.extend(ports);
    before..Layout::of(&*all, Direction::Output).len()
}

/// Returns the layout of the diagnostics of all parts.
pub(crate) fn diagnostics_layout(diagnostics: &[Port]) -> Result<Layout, WiringError> {
    check_names(
        "the list of diagnostics of drivers and devices",
        diagnostics,
    )?;
    Ok(Layout::of(diagnostics, Direction::Output))
}

/// A range of one flat vector that is copied to a range of another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Link {
    pub(crate) from: Range<usize>,
    pub(crate) to: Range<usize>,
}

impl Link {
    pub(crate) fn copy(&self, from: &[f64], to: &mut [f64]) {
        to[self.to.clone()].copy_from_slice(&from[self.from.clone()]);
    }

    /// Appends a link to `links`, as a part of the last one if it continues that: one copy costs
    /// less than many.
    pub(crate) fn append_to(self, links: &mut Vec<Self>) {
        match links.last_mut() {
            Some(last) if last.from.end == self.from.start && last.to.end == self.to.start => {
                (last.from.end, last.to.end) = (self.from.end, self.to.end);
            }
            _ => links.push(self),
        }
    }
}

/// Links of one task with the process.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct TaskLinks {
    /// From the process's outputs to the task's inputs.
    pub(crate) commands: Vec<Link>,
    /// From the task's outputs to the process's inputs.
    pub(crate) measurements: Vec<Link>,
}

/// Wires a process to its tasks: each signal of the process, except for monitors, needs a task,
/// each input of a task needs the process. Task outputs without a reader are permitted.
pub(crate) fn wire(
    process: &dyn Process,
    tasks: &[(String, Vec<Port>)],
) -> Result<Vec<TaskLinks>, WiringError> {
    let ports = process.ports();
    let (process_name, process_ports) = (process.name(), ports.as_slice());
    check_names(process_name, process_ports)?;
    for (n, (name, ports)) in tasks.iter().enumerate() {
        if tasks[..n].iter().any(|(other, _)| other == name) {
            return Err(WiringError::SameName { name: name.clone() });
        }
        check_names(name, ports)?;
    }
    let mut links = vec![TaskLinks::default(); tasks.len()];
    wire_commands(process, process_ports, tasks, &mut links)?;
    wire_measurements((process_name, process_ports), tasks, &mut links)?;
    Ok(links)
}

fn wire_commands(
    process: &dyn Process,
    process_ports: &[Port],
    tasks: &[(String, Vec<Port>)],
    links: &mut [TaskLinks],
) -> Result<(), WiringError> {
    let written = Layout::of(process_ports, Direction::Output);
    let accepted = tasks
        .iter()
        .flat_map(|(_, ports)| ports)
        .filter(|port| port.direction == Direction::Input);
    for Field { port, .. } in written.fields() {
        let is_accepted = accepted.clone().any(|other| other.connects(port));
        if !is_accepted && !process.is_monitor(&port.name) {
            return Err(unmatched(process.name(), port, accepted));
        }
    }
    for ((name, ports), links) in tasks.iter().zip(links) {
        for field in Layout::of(ports, Direction::Input).fields() {
            let from = find(&written, name, &field.port)?;
            let to = field.range();
            Link { from, to }.append_to(&mut links.commands);
        }
    }
    Ok(())
}

fn wire_measurements(
    (process_name, process_ports): (&str, &[Port]),
    tasks: &[(String, Vec<Port>)],
    links: &mut [TaskLinks],
) -> Result<(), WiringError> {
    let provided = tasks
        .iter()
        .flat_map(|(_, ports)| ports)
        .filter(|port| port.direction == Direction::Output);
    for field in Layout::of(process_ports, Direction::Input).fields() {
        let mut source: Option<&str> = None;
        for ((name, ports), links) in tasks.iter().zip(links.iter_mut()) {
            let Ok(from) = find(
                &Layout::of(ports, Direction::Output),
                process_name,
                &field.port,
            ) else {
                continue;
            };
            if let Some(first) = source {
                return Err(WiringError::TwoSources {
                    owner: process_name.into(),
                    port: Box::new(field.port.clone()),
                    first: first.into(),
                    second: name.clone(),
                });
            }
            source = Some(name);
            let to = field.range();
            Link { from, to }.append_to(&mut links.measurements);
        }
        if source.is_none() {
            return Err(unmatched(process_name, &field.port, provided));
        }
    }
    Ok(())
}
