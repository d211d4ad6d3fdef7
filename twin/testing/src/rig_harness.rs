//! A rig around a driver and its wire.

use std::sync::{Arc, Mutex};

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{
    Driver, Group, Observer, Plant, PlantFault, Process, Rig, RigError, RunEvent, Schedule, Wire,
    WiredTask,
};
use twinrig_wire::{Fault, FaultKind, FaultSchedule, FaultSelection};

/// Process that writes `command(number of the step)` to all its outputs.
pub struct ScriptedProcess {
    /// Outputs.
    pub ports: Vec<Port>,
    /// Value of all outputs, by number of the step.
    pub command: fn(u64) -> f64,
    /// Number of the next step.
    pub steps: u64,
}

impl Process for ScriptedProcess {
    fn name(&self) -> &'static str {
        "script"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn step(&mut self, _: SimDuration, _: &[f64], outputs: &mut [f64]) {
        outputs.fill((self.command)(self.steps));
        self.steps += 1;
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.steps)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.steps = snapshot.read()?;
        Ok(())
    }
}

/// Times and values of the changes of a plant's inputs.
pub type InputLog = Arc<Mutex<Vec<(SimTime, Vec<f64>)>>>;

/// Plant whose outputs are functions of time \[s\], one per component. It records its inputs.
pub struct RecordingPlant {
    /// Ports of the plant.
    pub ports: Vec<Port>,
    /// Outputs as functions of time \[s\] and component.
    pub signal: fn(f64, usize) -> f64,
    /// Present time.
    pub now: SimTime,
    /// Changes of the inputs.
    pub input_log: InputLog,
}

impl RecordingPlant {
    /// Creates a plant at time zero.
    pub fn new(ports: Vec<Port>, signal: fn(f64, usize) -> f64) -> Self {
        Self {
            ports,
            signal,
            now: SimTime::ZERO,
            input_log: InputLog::default(),
        }
    }
}

impl Plant for RecordingPlant {
    fn name(&self) -> &'static str {
        "recording"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let mut input_log = self.input_log.lock().unwrap();
        if input_log.last().is_none_or(|(_, last)| last != inputs) {
            input_log.push((self.now, inputs.to_vec()));
        }
        drop(input_log);
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        for (n, output) in outputs.iter_mut().enumerate() {
            *output = (self.signal)(self.now.as_secs_f64(), n);
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.now)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.now = snapshot.read()?;
        Ok(())
    }
}

/// Record of an observed run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunLog {
    /// Inputs of the process.
    pub inputs: Vec<(SimTime, Vec<f64>)>,
    /// Last diagnostics.
    pub diagnostics: Vec<f64>,
    /// Events.
    pub events: Vec<(SimTime, RunEvent)>,
    /// Traced bytes, by number of the trace.
    pub bytes: Vec<(SimTime, usize, Vec<u8>)>,
}

impl Observer for RunLog {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::ProcessInputs => self.inputs.push((now, values.to_vec())),
            Group::Diagnostics => self.diagnostics = values.to_vec(),
            Group::Plant | Group::ProcessOutputs => {}
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.events.push((now, event));
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        self.bytes.push((now, trace, bytes.to_vec()));
    }
}

impl RunLog {
    /// Returns the number of events for which `wanted` holds.
    pub fn count(&self, wanted: impl Fn(&RunEvent) -> bool) -> usize {
        self.events
            .iter()
            .filter(|(_, event)| wanted(event))
            .count()
    }
}

/// Builds a rig of a driver and its wire, with a process that has every port of the driver.
pub fn rig(
    driver: impl Driver + 'static,
    wire: impl Wire + 'static,
    (period_ms, command): (u64, fn(u64) -> f64),
    plant: RecordingPlant,
) -> Rig {
    let script = ScriptedProcess {
        ports: driver.ports().iter().map(Port::mirrored).collect(),
        command,
        steps: 0,
    };
    let task = WiredTask::new(Box::new(driver), Box::new(wire));
    let schedule = Schedule::with_period(SimDuration::from_millis(period_ms));
    Rig::new(
        &schedule,
        Box::new(script),
        vec![Box::new(task)],
        Box::new(plant),
    )
    .unwrap()
}

/// Runs a rig up to `end_ms` and returns its record and its result.
pub fn run(rig: &mut Rig, end_ms: u64) -> (RunLog, Result<(), RigError>) {
    let mut log = RunLog::default();
    let end = SimTime::ZERO + SimDuration::from_millis(end_ms);
    let ended = rig.run_until(end, &mut log);
    (log, ended)
}

/// Returns a schedule of one fault.
pub fn fault(on: &str, kind: FaultKind, from_ms: u64, for_ms: u64) -> FaultSchedule {
    FaultSchedule {
        faults: vec![Fault {
            at: SimTime::ZERO + SimDuration::from_millis(from_ms),
            on: on.to_owned(),
            kind,
            lasts: SimDuration::from_millis(for_ms),
            select: FaultSelection::default(),
        }],
        seed: 1,
    }
}

/// Checks that a rig that is saved at each of these times and restored continues bit for bit.
pub fn check_restored(rig: impl Fn() -> Rig, saved_ms: &[u64], end_ms: u64) {
    for &save_ms in saved_ms {
        let mut original = rig();
        run(&mut original, save_ms).1.unwrap();
        let mut restored = rig();
        restored.restore(&original.save()).unwrap();
        let rest = run(&mut original, end_ms);
        assert_eq!(run(&mut restored, end_ms), rest, "{save_ms} ms");
    }
}

/// Checks that these diagnostics of a bus are 0.
pub fn check_zero(rig: &Rig, log: &RunLog, bus: &str, diagnostics: &[&str]) {
    for name in diagnostics {
        let name = format!("{bus}/{name}");
        assert_eq!(diagnostic(rig, log, &name), 0.0, "{name}");
    }
}

/// Returns the diagnostic of that name.
pub fn diagnostic(rig: &Rig, log: &RunLog, name: &str) -> f64 {
    let place = rig.layout(Group::Diagnostics).find(name);
    log.diagnostics[place
        .unwrap_or_else(|| panic!("no diagnostic {name}"))
        .start]
}

/// Returns the index of the driver's output port of that name.
pub fn index_of(ports: &[Port], name: &str) -> usize {
    Layout::of(ports, Direction::Output)
        .find(name)
        .unwrap()
        .start
}
