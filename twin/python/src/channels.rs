//! Steps of a rig without the interpreter: commands in, signals out.

use std::ops::Range;

use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use twinrig::kernel::SimDuration;
use twinrig::runtime::{Change, Group, RigError};

use crate::rig::{PyRig, refused};
use crate::rig_state::{Latest, Place, RigState};
use crate::samples::seconds;

/// Names of the commanded process variables and outputs of the controller, and of the signals that
/// are read.
pub(crate) type Names = (Vec<String>, Vec<String>);

/// Columns of the commands and of the values of a rig.
pub(crate) struct Channels {
    commands: Vec<Command>,
    signals: Vec<Place>,
    /// Number of columns of the commands.
    pub(crate) commanded: usize,
    /// Number of columns of the values.
    pub(crate) read: usize,
}

/// Process variable or output of the controller.
struct Command {
    name: String,
    is_variable: bool,
    columns: Range<usize>,
}

impl Channels {
    /// Finds signals and commands of a rig.
    pub(crate) fn new(state: &mut RigState, (commands, signals): &Names) -> PyResult<Self> {
        let mut commanded = 0;
        let mut command = |name: &String| {
            let variables = state.rig.process().variables();
            let is_variable = variables.iter().any(|variable| variable.name() == name);
            let start = commanded;
            commanded += if is_variable {
                1
            } else {
                // Refuses any other name.
                state.rig.override_output(name, None).map_err(refused)?;
                let outputs = state.rig.layout(Group::ProcessOutputs);
                outputs.find(name).map_or(0, |range| range.len())
            };
            Ok(Command {
                name: name.clone(),
                is_variable,
                columns: start..commanded,
            })
        };
        let commands = commands.iter().map(&mut command);
        let commands = commands.collect::<PyResult<_>>()?;
        let signals = signals.iter().map(|name| state.known_place(name));
        let signals: Vec<_> = signals.collect::<PyResult<_>>()?;
        let read = signals.iter().map(|(_, range)| range.len()).sum();
        Ok(Self {
            commands,
            signals,
            commanded,
            read,
        })
    }

    /// Gives the rig commands, from its next control step on.
    fn apply(&self, state: &mut RigState, row: &[f64]) -> Result<(), RigError> {
        let (rig, now) = (&mut state.rig, state.reached);
        for command in &self.commands {
            match &row[command.columns.clone()] {
                [value] if command.is_variable => {
                    rig.schedule(now, &command.name, Change::To(*value))?;
                }
                values => rig.override_output(&command.name, Some(values))?,
            }
        }
        Ok(())
    }

    /// Reads the newest values of the signals.
    fn read(&self, latest: &Latest, mut row: &mut [f64]) {
        for place in &self.signals {
            let values = latest.values(place);
            if let Some(columns) = row.split_off_mut(..values.len()) {
                columns.copy_from_slice(values);
            }
        }
    }
}

/// Results of the steps of all lanes, lane after lane: NaN and false where there is none.
pub(crate) struct Results {
    /// Values of the signals, row by row.
    pub(crate) values: Vec<f64>,
    /// Time at the end of each step \[s\].
    pub(crate) times: Vec<f64>,
    /// Whether the robot is on the ground at the end of each step.
    pub(crate) has_fallen: Vec<bool>,
    steps: usize,
    read: usize,
}

impl Results {
    /// Creates the results of `steps` steps of each of `lanes`, with `read` values each.
    pub(crate) fn new(lanes: usize, steps: usize, read: usize) -> PyResult<Self> {
        let rows = lanes.checked_mul(steps);
        let count = rows.and_then(|rows| rows.checked_mul(read));
        let rooms = rows.zip(count).and_then(|(rows, count)| {
            Some((
                filled(count, f64::NAN)?,
                filled(rows, f64::NAN)?,
                filled(rows, false)?,
            ))
        });
        let (values, times, has_fallen) = rooms.ok_or_else(|| {
            PyMemoryError::new_err(format!(
                "{lanes} × {steps} × {read} values do not fit into memory: take fewer steps a call, and continue"
            ))
        })?;
        Ok(Self {
            values,
            times,
            has_fallen,
            steps,
            read,
        })
    }

    /// Returns the steps of each lane. `commands` has the rows of all of them.
    pub(crate) fn lanes<'a>(&'a mut self, commands: &'a [f64], lanes: usize) -> Vec<Steps<'a>> {
        let commanded = commands.len() / (lanes * self.steps).max(1);
        let (mut values, mut times) = (&mut self.values[..], &mut self.times[..]);
        let mut has_fallen = &mut self.has_fallen[..];
        let lane = |lane: usize| Steps {
            commands: &commands[lane * self.steps * commanded..][..self.steps * commanded],
            values: values
                .split_off_mut(..self.steps * self.read)
                .unwrap_or_default(),
            times: times.split_off_mut(..self.steps).unwrap_or_default(),
            has_fallen: has_fallen.split_off_mut(..self.steps).unwrap_or_default(),
        };
        (0..lanes).map(lane).collect()
    }
}

fn filled<T: Clone>(count: usize, value: T) -> Option<Vec<T>> {
    let mut items = Vec::new();
    items.try_reserve_exact(count).ok()?;
    items.resize(count, value);
    Some(items)
}

/// Steps of one rig: rows of its commands, and places of its results.
pub(crate) struct Steps<'a> {
    commands: &'a [f64],
    values: &'a mut [f64],
    times: &'a mut [f64],
    has_fallen: &'a mut [bool],
}

/// Step at which a lane has failed, the time \[s\] and the reason.
pub(crate) type LaneFailure = (usize, f64, PyErr);

impl Steps<'_> {
    /// Returns the number of steps.
    pub(crate) fn count(&self) -> usize {
        self.times.len()
    }

    /// Whether commands and results are those of `channels`.
    pub(crate) fn fits(&self, channels: &Channels) -> bool {
        let steps = self.count();
        self.commands.len() == steps * channels.commanded
            && self.values.len() == steps * channels.read
    }

    /// Advances a rig by steps of `step`, of which the last may be cut short by the end of the
    /// scenario.
    pub(crate) fn run(
        &mut self,
        rig: &PyRig,
        state: &mut RigState,
        channels: &Channels,
        step: SimDuration,
    ) -> Result<(), LaneFailure> {
        for k in 0..self.count() {
            let advanced = self.advance(k, (rig, state), channels, step);
            advanced.map_err(|error| (k, seconds(state.reached), error))?;
            channels.read(
                &state.latest,
                &mut self.values[k * channels.read..][..channels.read],
            );
            self.times[k] = seconds(state.reached);
            self.has_fallen[k] = rig.fall.holds(&state.latest);
        }
        Ok(())
    }

    fn advance(
        &self,
        k: usize,
        (rig, state): (&PyRig, &mut RigState),
        channels: &Channels,
        step: SimDuration,
    ) -> PyResult<()> {
        let to = rig.after(state.reached, step)?;
        let row = &self.commands[k * channels.commanded..][..channels.commanded];
        channels.apply(state, row).map_err(refused)?;
        let outcome = state.run_until(to);
        state.finish(to, outcome)
    }
}
