use std::sync::{Arc, Mutex};

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit, stream};
use twinrig_runtime::{IoTask, Part, PlantAccess, PlantSignals, Progress, TaskError, WiringError};

/// Bytes of one transfer of a [`ToyTask`]: chunks, and their times since its beginning.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WireTransfer {
    pub chunks: Vec<(SimDuration, Vec<u8>)>,
    pub ended: Option<SimDuration>,
}

/// A task with a protocol: packet `number` carries one command to the device in several chunks, at
/// random times; after the last one the device actuates and answers with a measurement.
pub struct ToyTask {
    name: String,
    shape: Shape,
    signals: (std::ops::Range<usize>, std::ops::Range<usize>),
    state: State,
    /// Bytes on the wire, one entry per transfer.
    pub wire: Arc<Mutex<Vec<WireTransfer>>>,
}

/// Parameters of a task's packets, apart from their data.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Shape {
    seed: u64,
    delay_max: SimDuration,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    number: u64,
    begun: SimTime,
    /// Chunks still to be sent, in reverse order.
    plan: Vec<(SimDuration, Vec<u8>)>,
    command: f64,
    sample: [f64; 2],
}

/// Returns the bytes of transfer `number` of task `name` with command `command`.
pub fn expected_transfer(
    name: &str,
    seed: u64,
    delay_max: SimDuration,
    number: u64,
    command: f64,
) -> WireTransfer {
    let chunks = plan(name, &Shape { seed, delay_max }, number, command);
    WireTransfer {
        ended: chunks.last().map(|(at, _)| *at),
        chunks,
    }
}

fn plan(name: &str, shape: &Shape, number: u64, command: f64) -> Vec<(SimDuration, Vec<u8>)> {
    let mut random = stream(shape.seed, &format!("{name}/{number}"));
    let mut packet = vec![0xff, 0xff];
    packet.extend(number.to_le_bytes());
    packet.extend(command.to_le_bytes());
    packet.push(packet.iter().fold(0, |sum, byte| sum ^ byte));
    let mut at = SimDuration::ZERO;
    let size = usize::try_from(random.between(5, 19)).unwrap();
    let chunk = |bytes: &[u8]| {
        at += SimDuration::from_nanos(random.between(0, shape.delay_max.as_nanos()));
        (at, bytes.to_vec())
    };
    packet.chunks(size).map(chunk).collect()
}

impl ToyTask {
    pub fn new(name: &str, seed: u64, delay_max: SimDuration) -> Self {
        let state = State {
            number: 0,
            begun: SimTime::ZERO,
            plan: Vec::new(),
            command: 0.0,
            sample: [0.0; 2],
        };
        Self {
            name: name.into(),
            shape: Shape { seed, delay_max },
            signals: (0..0, 0..0),
            state,
            wire: Arc::default(),
        }
    }

    /// Sends the chunk that is due.
    fn send_due(
        &mut self,
        now: SimTime,
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        let after = now - self.state.begun;
        let Some((at, bytes)) = self.state.plan.pop() else {
            return Ok(Progress::Done);
        };
        if at > after {
            self.state.plan.push((at, bytes));
            return Ok(Progress::WakeAt(self.state.begun + at));
        }
        let mut wire = self.wire.lock().unwrap();
        let transfer = wire.last_mut().unwrap();
        transfer.chunks.push((after, bytes));
        if let Some((next, _)) = self.state.plan.last() {
            return Ok(Progress::WakeAt(self.state.begun + *next));
        }
        transfer.ended = Some(after);
        plant.actuate(self.signals.0.clone())?[0] = self.state.command;
        let value = plant.sample(self.signals.1.clone())?[0];
        self.state.number += 1;
        #[expect(clippy::cast_precision_loss, reason = "a few transfers")]
        let number = self.state.number as f64;
        self.state.sample = [number, value];
        Ok(Progress::Done)
    }
}

impl Part for ToyTask {
    fn connect(&mut self, _owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let command = Port::output(format!("{}/command", self.name), Unit::Volt, 1);
        let value = Port::input(format!("{}/value", self.name), Unit::Radian, 1);
        self.signals = (
            plant.find(&self.name, &command)?,
            plant.find(&self.name, &value)?,
        );
        Ok(())
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        // The wire of a new task has no entry for the transfer in progress.
        if !self.state.plan.is_empty() {
            self.wire.lock().unwrap().push(WireTransfer::default());
        }
        Ok(())
    }
}

impl IoTask for ToyTask {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        vec![
            Port::input(format!("{}/command", self.name), Unit::Volt, 1),
            Port::output(format!("{}/sample", self.name), Unit::One, 2),
        ]
    }

    fn begin(
        &mut self,
        now: SimTime,
        from_process: &[f64],
        plant: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        // Not checked against the last transfer: a manager that begins too early is detected on the
        // wire.
        self.state.begun = now;
        self.state.command = from_process[0];
        self.state.plan = plan(
            &self.name,
            &self.shape,
            self.state.number,
            self.state.command,
        );
        self.state.plan.reverse();
        self.wire.lock().unwrap().push(WireTransfer::default());
        self.send_due(now, plant)
    }

    fn wake(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        self.send_due(now, plant)
    }

    fn to_process(&self) -> &[f64] {
        &self.state.sample
    }
}
