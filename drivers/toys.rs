//! Test components that close the loop around a driver. Included by the tests of each driver crate.
#![allow(dead_code, reason = "each test uses some of it")]

use std::sync::{Arc, Mutex};

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_runtime::{
    Driver, EnergyBalance, Group, Observer, Plant, PlantFault, Process, Rig, RigError, RunEvent,
    Schedule, Wire, WiredTask, WorkCounts,
};

/// Process that writes `command(number of the step)` to all its outputs.
pub struct Script {
    pub ports: Vec<Port>,
    pub command: fn(u64) -> f64,
    pub steps: u64,
}

impl Process for Script {
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
pub type Heard = Arc<Mutex<Vec<(SimTime, Vec<f64>)>>>;

/// Plant whose outputs are functions of time \[s\], one per component. It records its inputs.
pub struct PlantAccess {
    pub ports: Vec<Port>,
    pub signal: fn(f64, usize) -> f64,
    pub now: SimTime,
    pub heard: Heard,
}

impl PlantAccess {
    /// Creates a plant at time zero.
    pub fn new(ports: Vec<Port>, signal: fn(f64, usize) -> f64) -> Self {
        Self {
            ports,
            signal,
            now: SimTime::ZERO,
            heard: Heard::default(),
        }
    }
}

impl Plant for PlantAccess {
    fn name(&self) -> &'static str {
        "world"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        let mut heard = self.heard.lock().unwrap();
        if heard.last().is_none_or(|(_, last)| last != inputs) {
            heard.push((self.now, inputs.to_vec()));
        }
        drop(heard);
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        for (n, output) in outputs.iter_mut().enumerate() {
            *output = (self.signal)(self.now.as_secs_f64(), n);
        }
    }

    fn energy(&self) -> EnergyBalance {
        EnergyBalance::default()
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::default()
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
pub struct Log {
    pub inputs: Vec<(SimTime, Vec<f64>)>,
    pub diagnostics: Vec<f64>,
    pub events: Vec<(SimTime, RunEvent)>,
    pub bytes: Vec<(SimTime, usize, Vec<u8>)>,
}

impl Observer for Log {
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

impl Log {
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
    plant: PlantAccess,
) -> Rig {
    let script = Script {
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
pub fn run(rig: &mut Rig, end_ms: u64) -> (Log, Result<(), RigError>) {
    let mut log = Log::default();
    let end = SimTime::ZERO + SimDuration::from_millis(end_ms);
    let ended = rig.run_until(end, &mut log);
    (log, ended)
}

/// Returns the diagnostic of that name.
pub fn diagnostic(rig: &Rig, log: &Log, name: &str) -> f64 {
    let place = rig.layout(Group::Diagnostics).find(name);
    log.diagnostics[place.unwrap_or_else(|| panic!("no gauge {name}")).start]
}

/// Returns the index of the driver's output port of that name.
pub fn place(ports: &[Port], name: &str) -> usize {
    Layout::of(ports, Direction::Output)
        .find(name)
        .unwrap()
        .start
}
