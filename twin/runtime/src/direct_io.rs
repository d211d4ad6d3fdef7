use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Layout, Port, SimTime, Snapshot, SnapshotError};

use crate::wiring::Link;
use crate::{
    IoTask, Part, PlantAccess, PlantSignals, Progress, TaskError, TimeSource, Timing, TimingError,
    WiringError,
};

/// Direct transfer of signals between process and plant, in place of bus, boards and drivers.
///
/// A transfer takes a modelled time. At half of it the commands are applied to the plant and the
/// measurements are sampled, both at one instant, as if a packet was sent and its answer returned.
#[derive(Debug)]
pub struct DirectIo {
    name: String,
    ports: Vec<Port>,
    /// Links from the process to the plant, and from the plant to the process.
    commands: Vec<Link>,
    measurements: Vec<Link>,
    plant_sizes: (usize, usize),
    state: State,
}

#[derive(Debug, Serialize, Deserialize)]
struct State {
    transfer: TimeSource,
    phase: Phase,
    from_process: Vec<f64>,
    to_process: Vec<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Phase {
    Idle,
    /// Before the exchange with the plant; the transfer ends at `end`.
    Out {
        end: SimTime,
    },
    /// After the exchange with the plant.
    Back,
}

impl DirectIo {
    /// Creates a task that carries every signal of a process with these ports. The transfer times
    /// are drawn from the stream `NAME/transfer`.
    ///
    /// # Errors
    /// [`TimingError`] if the timing is invalid.
    pub fn for_process(
        name: impl Into<String>,
        process_ports: &[Port],
        transfer: Timing,
        seed: u64,
    ) -> Result<Self, TimingError> {
        let name = name.into();
        let ports: Vec<Port> = process_ports.iter().map(Port::mirrored).collect();
        let state = State {
            transfer: transfer.source(seed, &format!("{name}/transfer"))?,
            phase: Phase::Idle,
            from_process: vec![0.0; Layout::of(&ports, Direction::Input).len()],
            to_process: vec![0.0; Layout::of(&ports, Direction::Output).len()],
        };
        Ok(Self {
            name,
            ports,
            commands: Vec::new(),
            measurements: Vec::new(),
            plant_sizes: (0, 0),
            state,
        })
    }

    /// Samples the measurements, then applies the commands.
    fn exchange(&mut self, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        let (inputs, outputs) = self.plant_sizes;
        if !self.measurements.is_empty() {
            let sampled = plant.sample(0..outputs)?;
            for link in &self.measurements {
                link.copy(sampled, &mut self.state.to_process);
            }
        }
        if !self.commands.is_empty() {
            let actuated = plant.actuate(0..inputs)?;
            for link in &self.commands {
                link.copy(&self.state.from_process, actuated);
            }
        }
        Ok(())
    }
}

impl Part for DirectIo {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let links = |direction| {
            let mut links = Vec::new();
            for field in Layout::of(&self.ports, direction).fields() {
                let plant_range = plant.find(owner, &field.port.mirrored())?;
                let (from, to) = match direction {
                    Direction::Input => (field.range(), plant_range),
                    Direction::Output => (plant_range, field.range()),
                };
                Link { from, to }.append_to(&mut links);
            }
            Ok::<_, WiringError>(links)
        };
        (self.commands, self.measurements) = (links(Direction::Input)?, links(Direction::Output)?);
        self.plant_sizes = (plant.inputs.len(), plant.outputs.len());
        Ok(())
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let state: State = snapshot.read()?;
        let sizes = |state: &State| (state.from_process.len(), state.to_process.len());
        if sizes(&state) != sizes(&self.state) {
            let describe = |(inputs, outputs)| {
                format!("direct I/O of {inputs} commands and {outputs} measurements")
            };
            return Err(SnapshotError::Mismatch {
                expected: describe(sizes(&self.state)),
                found: describe(sizes(&state)),
            });
        }
        self.state = state;
        Ok(())
    }
}

impl IoTask for DirectIo {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn begin(
        &mut self,
        now: SimTime,
        from_process: &[f64],
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        self.state.from_process.copy_from_slice(from_process);
        let duration = self.state.transfer.draw();
        if duration.is_zero() {
            self.exchange(plant)?;
            return Ok(Progress::Done);
        }
        self.state.phase = Phase::Out {
            end: now + duration,
        };
        Ok(Progress::WakeAt(now + duration / 2))
    }

    fn wake(&mut self, _now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        match self.state.phase {
            Phase::Out { end } => {
                self.exchange(plant)?;
                self.state.phase = Phase::Back;
                Ok(Progress::WakeAt(end))
            }
            Phase::Back | Phase::Idle => {
                self.state.phase = Phase::Idle;
                Ok(Progress::Done)
            }
        }
    }

    fn to_process(&self) -> &[f64] {
        &self.state.to_process
    }
}
