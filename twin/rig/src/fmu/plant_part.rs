//! A plant alone in an FMU.

use twinrig_kernel::signal::magnitude_max;
use twinrig_kernel::{Direction, Layout, SimDuration, SimTime, Snapshot};
use twinrig_runtime::{Group, PartKind, Plant, RigError, VariableError, in_part};

use crate::fmu::part::{Simulated, mismatch};
use crate::fmu::variables::Variables;

/// A plant whose commands are set from outside.
///
/// FMI has no call for [`Plant::begin_window`], which a rig makes at every instant of the
/// observation grid, after the observation. Here the call is made at the beginning of the step that
/// starts at such an instant, and a longer step is divided there: the plant receives the same calls
/// as in a rig, and gives the same bits.
pub(crate) struct PlantPart {
    plant: Box<dyn Plant>,
    name: String,
    /// Period of the observation grid.
    window: SimDuration,
    now: SimTime,
    inputs: Vec<f64>,
    commands: Layout,
    outputs: Vec<f64>,
}

impl PlantPart {
    /// Creates the part around a plant at its start.
    pub(crate) fn new(plant: Box<dyn Plant>, window: SimDuration) -> (Self, Variables) {
        let ports = plant.ports();
        let commands = Layout::of(&ports, Direction::Input);
        let observed = Layout::of(&ports, Direction::Output);
        let mut inputs = vec![0.0; commands.len()];
        plant.initial_inputs(&mut inputs);
        let mut variables = Variables::new();
        variables.add_commands(&commands, &inputs);
        variables.add_outputs(Group::Plant, &observed);
        let part = Self {
            name: plant.name().to_owned(),
            plant,
            window,
            now: SimTime::ZERO,
            inputs,
            commands,
            outputs: vec![0.0; observed.len()],
        };
        (part, variables)
    }

    /// Returns the next instant of the observation grid.
    fn window_end(&self) -> Option<SimTime> {
        let window = self.window.as_nanos().max(1);
        let next = (self.now.as_nanos() / window).checked_add(1)?;
        let since_start = SimDuration::from_nanos(window).checked_mul(next)?;
        SimTime::ZERO.checked_add(since_start)
    }

    /// Refuses a command beyond the range of the model description.
    fn check(&self, index: usize, value: f64) -> Result<(), RigError> {
        let port = self.commands.field_at(index).map(|field| &field.port);
        match port.and_then(|port| Some((port, magnitude_max(port)?))) {
            Some((port, most)) if value.abs() > most => Err(RigError::Change {
                at: self.now,
                source: VariableError::OutOfRange {
                    name: port.name.clone(),
                    value,
                    range: format!("[-{most}, {most}]"),
                },
            }),
            _ => Ok(()),
        }
    }

    fn is_on_grid(&self) -> bool {
        self.now.since_start().is_multiple_of(self.window)
    }
}

impl Simulated for PlantPart {
    fn input(&self, index: usize) -> f64 {
        self.inputs[index]
    }

    fn set_inputs(&mut self, values: &[(usize, f64)]) -> Result<(), RigError> {
        for &(index, value) in values {
            self.check(index, value)?;
        }
        for &(index, value) in values {
            self.inputs[index] = value;
        }
        Ok(())
    }

    fn begin(&mut self) -> Result<(), RigError> {
        Ok(())
    }

    fn advance(&mut self, to: SimTime) -> Result<(), RigError> {
        while self.now < to {
            let end = self.window_end().map_or(to, |end| end.min(to));
            let begins_window = self.is_on_grid();
            let Self {
                plant,
                name,
                inputs,
                ..
            } = self;
            in_part(PartKind::Plant, name, || {
                if begins_window {
                    plant.begin_window();
                }
                plant.advance(end, inputs)
            })?;
            self.now = end;
        }
        Ok(())
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn observe(&mut self) -> Result<(), RigError> {
        let Self { plant, outputs, .. } = self;
        in_part(PartKind::Plant, &self.name, || plant.observe(outputs));
        Ok(())
    }

    fn output(&self, _: Group, index: usize) -> f64 {
        self.outputs[index]
    }

    fn fingerprint(&self) -> Option<String> {
        None
    }

    fn save(&self) -> Snapshot {
        let plant = in_part(PartKind::Plant, &self.name, || self.plant.save());
        Snapshot::of(&(self.now, &self.inputs, plant))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), RigError> {
        let (now, inputs, plant) = snapshot.read::<(SimTime, Vec<f64>, Snapshot)>()?;
        if inputs.len() != self.inputs.len() {
            return Err(mismatch(self.inputs.len(), inputs.len()));
        }
        in_part(PartKind::Plant, &self.name, || self.plant.restore(&plant))?;
        (self.now, self.inputs) = (now, inputs);
        Ok(())
    }
}
