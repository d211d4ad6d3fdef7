//! The whole stack at work: a process that commands something new each cycle, driver, wire, boards, and the scope behind them.

use std::collections::BTreeMap;

use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError};
use twinrig_motordriver::{Bus, BusConfig};
use twinrig_runtime::{
    Driver, Group, Observer, Process, Rig, RunEvent, Schedule, Timing, WiredTask,
};

use crate::scope::{LEGS, MEASURED, Scope, Screen, Shown, angle, look, scramble};

/// What the process commands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Commands {
    /// Anything, and nothing twice.
    Random,
    /// Not more than so many counts from one cycle to the next, and always somewhere else.
    Walk(u64),
}

/// Set-points of a leg in counts.
pub type Goals = [i64; 2];

struct Script {
    ports: Vec<Port>,
    seed: u64,
    commands: Commands,
    cycle: u64,
    at: [Goals; 4],
}

impl Script {
    fn goals(&self, leg: usize) -> Goals {
        let draw = |n: u64, below: u64| {
            let drawn = scramble(self.seed ^ (n << 32), self.cycle, leg as u64) % below;
            i64::try_from(drawn).unwrap()
        };
        match self.commands {
            // The cycle in the knee makes pairs that come only once.
            Commands::Random => {
                let turn = i64::try_from(self.cycle % 1_349).unwrap();
                [1 + draw(0, 1_199), 1 + turn]
            }
            Commands::Walk(most) => [0, 1].map(|joint| {
                let way = 1 + draw(joint as u64, most);
                let at = self.at[leg][joint];
                let up = draw(2 + joint as u64, 2) == 0 && at < 1_000 || at < 200;
                if up { at + way } else { at - way }
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
            self.at[leg] = self.goals(leg);
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

/// A set-point on its way: what the master wrote for a leg, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sent {
    pub at: SimTime,
    pub goals: Goals,
}

/// A transfer, from its beginning to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    pub begun: SimTime,
    pub ended: Option<SimTime>,
    /// What the master had counted as errors when it began.
    pub errors_before: f64,
}

/// Everything that can be seen from outside.
#[derive(Default)]
pub struct Watch {
    pub opened: Option<SimTime>,
    pub cycles: Vec<Cycle>,
    pub skipped: u64,
    /// Leg by leg.
    pub sent: [Vec<Sent>; 4],
    /// When the process looked, and what it got.
    pub got: Vec<(SimTime, Vec<f64>)>,
    diagnostics: Vec<f64>,
    errors: Option<usize>,
}

impl Watch {
    /// What the master writes is one whole packet after the other.
    fn written(&mut self, now: SimTime, mut bytes: &[u8]) {
        while let [0xFF, _, id, length, instruction, rest @ ..] = bytes {
            let body = usize::from(*length) - 2;
            if let (0x10, [a, b, c, d]) = (*instruction, &rest[..body]) {
                let goals = [[*a, *b], [*c, *d]].map(|word| i64::from(u16::from_le_bytes(word)));
                self.sent[usize::from(*id) - 1].push(Sent { at: now, goals });
            }
            bytes = &rest[body + 1..];
        }
        assert!(bytes.is_empty(), "the master writes whole packets");
    }
}

impl Observer for Watch {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::ProcessInputs => self.got.push((now, values.to_vec())),
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
                errors_before: self.errors.map_or(0.0, |place| self.diagnostics[place]),
            }),
            RunEvent::TaskEnd { .. } => self.cycles.last_mut().unwrap().ended = Some(now),
            RunEvent::TaskSkipped { .. } => self.skipped += 1,
            _ => {}
        }
    }

    fn bytes(&mut self, now: SimTime, trace: usize, bytes: &[u8]) {
        if trace == 0 {
            self.written(now, bytes);
        }
    }
}

/// How the bench is driven.
#[derive(Clone, Debug)]
pub struct Drive {
    pub period: SimDuration,
    pub compute: Timing,
    pub commands: Commands,
    pub seed: u64,
}

pub struct Bench {
    pub rig: Rig,
    pub watch: Watch,
    screen: Screen,
    names: BTreeMap<String, usize>,
}

/// How finely gauges are looked at; no cycle ends so shortly before the next begins.
pub const GRID: SimDuration = SimDuration::from_micros(500);

impl Bench {
    pub fn new(config: &BusConfig, drive: &Drive) -> Self {
        let driver = Bus::driver(config).unwrap();
        let wire = Bus::wire(config).unwrap();
        let script = Script {
            ports: driver.ports().iter().map(Port::mirrored).collect(),
            seed: drive.seed,
            commands: drive.commands,
            cycle: 0,
            at: [[0; 2]; 4],
        };
        let schedule = Schedule {
            compute: drive.compute.clone(),
            observe: GRID,
            seed: drive.seed,
            ..Schedule::with_period(drive.period)
        };
        let screen = Screen::default();
        let task = WiredTask::new(Box::new(driver), Box::new(wire));
        let plant = Box::new(Scope::new(screen.clone()));
        let rig = Rig::new(&schedule, Box::new(script), vec![Box::new(task)], plant).unwrap();
        let layout = rig.layout(Group::Diagnostics);
        let names: BTreeMap<String, usize> = layout
            .fields()
            .map(|field| (field.port.name.clone(), field.range().start))
            .collect();
        let watch = Watch {
            errors: names.get("sbcp/errors").copied(),
            ..Watch::default()
        };
        Self {
            rig,
            watch,
            screen,
            names,
        }
    }

    /// Runs; why that ended, if it did before its time.
    pub fn run_until(&mut self, to: SimTime) -> Result<(), String> {
        let run = self.rig.run_until(to, &mut self.watch);
        run.map_err(|error| error.to_string())
    }

    /// Runs until all devices are open, and says when that was.
    pub fn open(&mut self) -> Result<SimTime, String> {
        let limit = SimTime::ZERO + SimDuration::from_secs(20);
        while self.watch.opened.is_none() {
            let step = self.rig.step(limit, &mut self.watch);
            if step.map_err(|error| error.to_string())?.is_none() {
                return Err("it did not open".into());
            }
        }
        Ok(self.watch.opened.unwrap())
    }

    /// The gauge, as it was last seen.
    pub fn diagnostic(&self, name: &str) -> f64 {
        match self.names.get(name) {
            Some(place) => self.watch.diagnostics[*place],
            None => panic!("no gauge {name}"),
        }
    }

    /// The gauges that end like that, added up.
    pub fn sum(&self, end: &str) -> f64 {
        let named = self.names.iter().filter(|(name, _)| name.ends_with(end));
        named.map(|(_, place)| self.watch.diagnostics[*place]).sum()
    }

    /// The gauge of a leg's board.
    pub fn of_leg(&self, leg: usize, what: &str) -> f64 {
        self.diagnostic(&format!("sbcp/{}/{what}", LEGS[leg]))
    }

    /// What the board of a leg showed, by the time of the run.
    pub fn shown(&self, leg: usize) -> Vec<Shown> {
        let held = self.watch.opened.unwrap_or(SimTime::ZERO).since_start();
        let screen = look(&self.screen);
        let shown = screen[leg].iter();
        let at = |shown: &Shown| Shown {
            from: shown.from + held,
            ..*shown
        };
        shown.map(at).collect()
    }

    /// What the process got of a leg.
    pub fn got(&self, leg: usize) -> impl Iterator<Item = (SimTime, Vec<f64>)> {
        let own = MEASURED * leg..MEASURED * (leg + 1);
        let of_leg =
            move |(at, values): &'_ (SimTime, Vec<f64>)| (*at, values[own.clone()].to_vec());
        self.watch.got.iter().map(of_leg)
    }
}
