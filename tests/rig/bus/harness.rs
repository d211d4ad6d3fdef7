//! Test harness of the complete stack: a process with new commands in each cycle, driver, wire,
//! boards, and the probe plant.

use std::collections::BTreeMap;

use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_motordriver::{Bus, BusConfig};
use twinrig_runtime::{
    Driver, Group, Observer, Process, Rig, RunEvent, Schedule, Timing, WiredTask,
};

use crate::bus::probe_plant::{
    AppliedSetPoints, LEGS, MEASURED, ProbePlant, SetPointLog, angle, hash, lock_log,
};

/// Commands of the process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Commands {
    /// Random set-points without repetition.
    Random,
    /// Random walk: each set-point differs from the previous one by at most this many counts, and
    /// by at least one.
    Walk(u64),
}

/// Set-points of a leg \[counts\].
pub type SetPoints = [i64; 2];

struct Script {
    ports: Vec<Port>,
    seed: u64,
    commands: Commands,
    cycle: u64,
    at: [SetPoints; 4],
}

impl Script {
    fn set_points(&self, leg: usize) -> SetPoints {
        let draw = |n: u64, below: u64| {
            let drawn = hash(self.seed ^ (n << 32), self.cycle, leg as u64) % below;
            i64::try_from(drawn).unwrap()
        };
        match self.commands {
            // The cycle number in the knee set-point makes each pair unique.
            Commands::Random => {
                let turn = i64::try_from(self.cycle % 1_349).unwrap();
                [1 + draw(0, 1_199), 1 + turn]
            }
            Commands::Walk(step_max) => [0, 1].map(|joint| {
                let step = 1 + draw(joint as u64, step_max);
                let at = self.at[leg][joint];
                let up = draw(2 + joint as u64, 2) == 0 && at < 1_000 || at < 200;
                if up { at + step } else { at - step }
            }),
        }
    }
}

impl Process for Script {
    fn name(&self) -> &'static str {
        "script"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn step(&mut self, _elapsed: SimDuration, _inputs: &[f64], outputs: &mut [f64]) {
        for (leg, commands) in outputs.chunks_exact_mut(2).enumerate() {
            self.at[leg] = self.set_points(leg);
            for (joint, command) in commands.iter_mut().enumerate() {
                *command = angle(leg, joint, self.at[leg][joint]);
            }
        }
        self.cycle += 1;
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.cycle, self.at))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.cycle, self.at) = snapshot.read()?;
        Ok(())
    }
}

/// A set-point written by the master for a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SentSetPoints {
    pub at: SimTime,
    pub set_points: SetPoints,
}

/// A transfer, from begin to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    pub begun: SimTime,
    pub ended: Option<SimTime>,
    /// Error count of the master at the begin.
    pub errors_before: f64,
}

/// Observer of all externally visible quantities.
#[derive(Default)]
pub struct BusMonitor {
    pub opened: Option<SimTime>,
    pub cycles: Vec<Cycle>,
    pub skipped: u64,
    /// By leg.
    pub sent: [Vec<SentSetPoints>; 4],
    /// Time and values of each sample of the process inputs.
    pub measurements: Vec<(SimTime, Vec<f64>)>,
    diagnostics: Vec<f64>,
    errors: Option<usize>,
}

impl BusMonitor {
    /// Decodes bytes written by the master, which are complete packets.
    fn decode_written(&mut self, now: SimTime, mut bytes: &[u8]) {
        while let [0xFF, _, id, length, instruction, rest @ ..] = bytes {
            let body = usize::from(*length) - 2;
            if let (0x10, [a, b, c, d]) = (*instruction, &rest[..body]) {
                let set_points =
                    [[*a, *b], [*c, *d]].map(|word| i64::from(u16::from_le_bytes(word)));
                self.sent[usize::from(*id) - 1].push(SentSetPoints {
                    at: now,
                    set_points,
                });
            }
            bytes = &rest[body + 1..];
        }
        assert!(bytes.is_empty(), "the master writes complete packets");
    }
}

impl Observer for BusMonitor {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::ProcessInputs => self.measurements.push((now, values.to_vec())),
            Group::Diagnostics => {
                self.diagnostics.clear();
                self.diagnostics.extend_from_slice(values);
            }
            Group::Plant | Group::ProcessOutputs => {}
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        match event {
            RunEvent::Opened => self.opened = Some(now),
            RunEvent::TaskBegin { .. } => self.cycles.push(Cycle {
                begun: now,
                ended: None,
                errors_before: self.errors.map_or(0.0, |offset| self.diagnostics[offset]),
            }),
            RunEvent::TaskEnd { .. } => self.cycles.last_mut().unwrap().ended = Some(now),
            RunEvent::TaskSkipped { .. } => self.skipped += 1,
            _ => {}
        }
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        if trace == 0 {
            self.decode_written(now, bytes);
        }
    }
}

/// Configuration of the process and of the schedule.
#[derive(Clone, Debug)]
pub struct ProcessConfig {
    pub period: SimDuration,
    pub compute: Timing,
    pub commands: Commands,
    pub seed: u64,
}

pub struct Harness {
    pub rig: Rig,
    pub monitor: BusMonitor,
    log: SetPointLog,
    names: BTreeMap<String, usize>,
}

/// Observation period of the diagnostics; every cycle ends at least this long before the next
/// begins.
pub const GRID: SimDuration = SimDuration::from_micros(500);

impl Harness {
    pub fn new(config: &BusConfig, process_config: &ProcessConfig) -> Self {
        let driver = Bus::driver(config).unwrap();
        let wire = Bus::wire(config).unwrap();
        let script = Script {
            ports: driver.ports().iter().map(Port::mirrored).collect(),
            seed: process_config.seed,
            commands: process_config.commands,
            cycle: 0,
            at: [[0; 2]; 4],
        };
        let schedule = Schedule {
            compute: process_config.compute.clone(),
            observe: GRID,
            seed: process_config.seed,
            ..Schedule::with_period(process_config.period)
        };
        let log = SetPointLog::default();
        let task = WiredTask::new(Box::new(driver), Box::new(wire));
        let plant = Box::new(ProbePlant::new(log.clone()));
        let rig = Rig::new(&schedule, Box::new(script), vec![Box::new(task)], plant).unwrap();
        let layout = rig.layout(Group::Diagnostics);
        let names: BTreeMap<String, usize> = layout
            .fields()
            .map(|field| (field.port.name.clone(), field.range().start))
            .collect();
        let monitor = BusMonitor {
            errors: names.get("sbcp/errors").copied(),
            ..BusMonitor::default()
        };
        Self {
            rig,
            monitor,
            log,
            names,
        }
    }

    /// Runs until `to`; the error is the reason for an earlier end.
    pub fn run_until(&mut self, to: SimTime) -> Result<(), String> {
        let run = self.rig.run_until(to, &mut self.monitor);
        run.map_err(|error| error.to_string())
    }

    /// Runs until all devices are open and returns the time.
    pub fn open(&mut self) -> Result<SimTime, String> {
        let limit = SimTime::ZERO + SimDuration::from_secs(20);
        while self.monitor.opened.is_none() {
            let step = self.rig.step(limit, &mut self.monitor);
            if step.map_err(|error| error.to_string())?.is_none() {
                return Err("the devices are not open after 20 s".into());
            }
        }
        Ok(self.monitor.opened.unwrap())
    }

    /// Returns the last value of a diagnostic.
    pub fn diagnostic(&self, name: &str) -> f64 {
        match self.names.get(name) {
            Some(offset) => self.monitor.diagnostics[*offset],
            None => panic!("no diagnostic {name}"),
        }
    }

    /// Returns the sum of all diagnostics whose names end with `end`.
    pub fn sum(&self, end: &str) -> f64 {
        let matching = self.names.iter().filter(|(name, _)| name.ends_with(end));
        matching
            .map(|(_, offset)| self.monitor.diagnostics[*offset])
            .sum()
    }

    /// Returns a diagnostic of the board of a leg.
    pub fn leg_diagnostic(&self, leg: usize, what: &str) -> f64 {
        self.diagnostic(&format!("sbcp/{}/{what}", LEGS[leg]))
    }

    /// Returns the set-points applied by the board of a leg, with times since the start of the run.
    pub fn applied(&self, leg: usize) -> Vec<AppliedSetPoints> {
        let opening_time = self.monitor.opened.unwrap_or(SimTime::ZERO).since_start();
        let log = lock_log(&self.log);
        let applied = log[leg].iter();
        let at = |applied: &AppliedSetPoints| AppliedSetPoints {
            from: applied.from + opening_time,
            ..*applied
        };
        applied.map(at).collect()
    }

    /// Returns the measurements of a leg received by the process.
    pub fn measurements(&self, leg: usize) -> impl Iterator<Item = (SimTime, Vec<f64>)> {
        let range = MEASURED * leg..MEASURED * (leg + 1);
        let of_leg =
            move |(at, values): &'_ (SimTime, Vec<f64>)| (*at, values[range.clone()].to_vec());
        self.monitor.measurements.iter().map(of_leg)
    }
}
