use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{
    Direction, EventQueue, Layout, Port, Rank, SimDuration, SimTime, Snapshot, SnapshotError,
    near_misses, signal::magnitude_max,
};

use crate::wiring::{TaskLinks, wire};
use crate::{
    Change, Observer, PartKind, Process, ProcessVariable, RigError, RunEvent, VariableError,
    WiringError, check_values, in_part,
};

/// A process, wired to its tasks, with its signals and pending changes, as used by both executors.
pub(crate) struct ProcessSlot {
    pub(crate) process: Box<dyn Process>,
    /// Name of the process.
    name: String,
    pub(crate) inputs: Layout,
    pub(crate) outputs: Layout,
    tasks: Vec<TaskConnection>,
    pub(crate) state: ProcessSlotState,
}

/// Connection of the process with a task.
struct TaskConnection {
    links: TaskLinks,
    /// Inputs of the task, collected at the beginning of a transfer.
    from_process: Vec<f64>,
}

/// Mutable state, apart from the process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ProcessSlotState {
    changes: EventQueue<PendingChange>,
    /// Replaced outputs: indices with their values, in ascending order.
    overrides: BTreeMap<usize, f64>,
    pub(crate) inputs: Vec<f64>,
    pub(crate) outputs: Vec<f64>,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct PendingChange {
    variable: usize,
    change: Change,
}

impl ProcessSlot {
    /// Wires a process to `tasks`, given by name and ports.
    pub(crate) fn new(
        process: Box<dyn Process>,
        tasks: &[(String, Vec<Port>)],
    ) -> Result<Self, WiringError> {
        let ports = process.ports();
        let links = wire(&*process, tasks)?;
        let connections = links.into_iter().zip(tasks);
        let inputs = Layout::of(&ports, Direction::Input);
        let outputs = Layout::of(&ports, Direction::Output);
        Ok(Self {
            name: process.name().to_owned(),
            process,
            tasks: connections
                .map(|(links, (_, ports))| TaskConnection {
                    links,
                    from_process: vec![0.0; Layout::of(ports, Direction::Input).len()],
                })
                .collect(),
            state: ProcessSlotState {
                changes: EventQueue::new(),
                overrides: BTreeMap::new(),
                inputs: vec![0.0; inputs.len()],
                outputs: vec![0.0; outputs.len()],
            },
            inputs,
            outputs,
        })
    }

    /// Copies the results of a task to the inputs of the process.
    pub(crate) fn accept_results(&mut self, task: usize, results: &[f64]) {
        for link in &self.tasks[task].links.measurements {
            link.copy(results, &mut self.state.inputs);
        }
    }

    /// Returns the task that carries an input of the process, and its range in the results of that
    /// task.
    pub(crate) fn source_of(&self, input: &Range<usize>) -> Option<(usize, Range<usize>)> {
        self.tasks
            .iter()
            .enumerate()
            .find_map(|(task, connection)| {
                let mut links = connection.links.measurements.iter();
                let link = links.find(|link| link.to.contains(&input.start))?;
                let start = link.from.start + (input.start - link.to.start);
                Some((task, start..start + input.len()))
            })
    }

    /// Returns the inputs of a task, copied from the outputs of the process.
    pub(crate) fn task_inputs(&mut self, task: usize) -> &[f64] {
        let TaskConnection {
            links,
            from_process,
        } = &mut self.tasks[task];
        for link in &links.commands {
            link.copy(&self.state.outputs, from_process);
        }
        from_process
    }

    /// Schedules a change, unless it is already known to be invalid.
    pub(crate) fn schedule(
        &mut self,
        now: SimTime,
        at: SimTime,
        variable: &str,
        change: Change,
        period: SimDuration,
    ) -> Result<(), RigError> {
        let variables = self.process.variables();
        let Some(index) = variables.iter().position(|known| known.name() == variable) else {
            let near = near_misses(variable, variables.iter().map(ProcessVariable::name));
            return Err(RigError::NoSuchVariable {
                process: self.process.name().into(),
                name: variable.into(),
                near: near.into_iter().map(String::from).collect(),
            });
        };
        if at < now {
            return Err(RigError::ChangeInThePast { at, now });
        }
        if let Change::To(value) = change {
            let checked = variables[index].check(value);
            checked
                .and_then(|()| variables[index].check_sampled(value, period))
                .map_err(|source| RigError::Change { at, source })?;
        }
        let pending = PendingChange {
            variable: index,
            change,
        };
        self.state.changes.push(at, Rank(0), pending);
        Ok(())
    }

    /// Checks values as [`check_values`] does.
    pub(crate) fn check_values(
        &mut self,
        values: &[(usize, f64)],
        period: SimDuration,
    ) -> Result<Result<(), VariableError>, SnapshotError> {
        let process = &mut *self.process;
        in_part(PartKind::Controller, &self.name, || {
            check_values(process, values, period)
        })
    }

    /// Replaces an output signal from the next iteration on, or ends its replacement.
    pub(crate) fn override_output(
        &mut self,
        signal: &str,
        values: Option<&[f64]>,
    ) -> Result<(), RigError> {
        let Some(range) = self.outputs.find(signal) else {
            let known = self.outputs.fields().map(|field| field.port.name.as_str());
            let near = near_misses(signal, known);
            return Err(RigError::NoSuchOutput {
                process: self.name.clone(),
                name: signal.to_owned(),
                near: near.into_iter().map(String::from).collect(),
            });
        };
        let Some(values) = values else {
            self.state
                .overrides
                .retain(|index, _| !range.contains(index));
            return Ok(());
        };
        if values.len() != range.len() || !values.iter().all(|value| value.is_finite()) {
            return Err(RigError::BadOverride {
                signal: signal.to_owned(),
                size: range.len(),
                values: values.to_vec(),
            });
        }
        self.check_magnitude(signal, values)?;
        self.state
            .overrides
            .extend(range.zip(values.iter().copied()));
        Ok(())
    }

    /// Refuses values beyond the magnitude that an output can have.
    fn check_magnitude(&self, signal: &str, values: &[f64]) -> Result<(), RigError> {
        let port = self.outputs.fields().map(|field| &field.port);
        let port = port.clone().find(|port| port.name == signal);
        let Some((port, most)) = port.and_then(|port| Some((port, magnitude_max(port)?))) else {
            return Ok(());
        };
        match values.iter().find(|value| value.abs() > most) {
            None => Ok(()),
            Some(&value) => Err(RigError::OverrideOutOfRange {
                signal: signal.to_owned(),
                unit: port.unit.symbol(),
                value,
                most,
            }),
        }
    }

    /// Applies the changes due at the control step `scheduled` and reports them to the observer at
    /// `now`.
    pub(crate) fn apply_changes<O: Observer>(
        &mut self,
        scheduled: SimTime,
        now: SimTime,
        observer: &mut O,
    ) -> Result<(), RigError> {
        while let Some(due) = self.state.changes.pop_until(scheduled) {
            let PendingChange { variable, change } = due.event;
            let process = &mut self.process;
            let set = in_part(PartKind::Controller, &self.name, || {
                let value = match change {
                    Change::To(value) => value,
                    Change::By(step) => process.variables()[variable].value() + step,
                };
                process.set_variable(variable, value).map(|()| value)
            });
            let value = set.map_err(|source| RigError::Change {
                at: due.time,
                source,
            })?;
            observer.event(now, RunEvent::Change { variable, value });
        }
        Ok(())
    }

    /// Sets a variable now, unless the process refuses the value, and reports that to the observer;
    /// returns whether it is set.
    pub(crate) fn try_change<O: Observer>(
        &mut self,
        variable: usize,
        value: f64,
        period: SimDuration,
        now: SimTime,
        observer: &mut O,
    ) -> bool {
        let process = &mut self.process;
        let set = in_part(PartKind::Controller, &self.name, || {
            let known = process.variables().get(variable);
            known.map_or(Ok(()), |known| known.check_sampled(value, period))?;
            process.set_variable(variable, value)
        });
        if set.is_ok() {
            observer.event(now, RunEvent::Change { variable, value });
        }
        set.is_ok()
    }

    /// Runs one iteration. A fault of the process ends the run, and so does a non-finite output: in
    /// the plant it would surface much later, without its cause.
    pub(crate) fn step(&mut self, now: SimTime, elapsed: SimDuration) -> Result<(), RigError> {
        let ProcessSlotState {
            inputs, outputs, ..
        } = &mut self.state;
        let fault = in_part(PartKind::Controller, &self.name, || {
            self.process.step(elapsed, inputs, outputs);
            self.process.fault()
        });
        if let Some(why) = fault {
            return Err(RigError::Process {
                process: self.name.clone(),
                why,
                time: now,
            });
        }
        let ProcessSlotState {
            overrides, outputs, ..
        } = &mut self.state;
        for (&index, &value) in &*overrides {
            if let Some(output) = outputs.get_mut(index) {
                *output = value;
            }
        }
        let outputs = &self.state.outputs;
        let Some(index) = outputs.iter().position(|value| !value.is_finite()) else {
            return Ok(());
        };
        Err(RigError::NotFinite {
            process: self.name.clone(),
            signal: self
                .outputs
                .field_at(index)
                .map_or_else(String::new, |field| field.port.name.clone()),
            value: outputs[index],
            time: now,
        })
    }

    /// Saves the state of the process.
    pub(crate) fn save(&self) -> Snapshot {
        in_part(PartKind::Controller, &self.name, || self.process.save())
    }
}
