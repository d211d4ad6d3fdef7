//! Test harness: driver, wire and boards, and motors that turn.

use core::f64::consts::TAU;
use std::ops::Range;

use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_motordriver::{BoardConfig, Bus, BusConfig};
use twinrig_runtime::{
    IoTask, Part, PlantAccess, PlantFault, PlantSignals, Progress, TaskError, WiredTask,
};

pub const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];
/// Angle of a count \[rad\].
pub const COUNT: f64 = TAU / 4_096.0;

pub const fn millis(n: u64) -> SimDuration {
    SimDuration::from_millis(n)
}

pub fn at_ms(n: u64) -> SimTime {
    SimTime::ZERO + millis(n)
}

/// Plant of a harness.
pub trait Plant: PlantAccess + Clone {
    fn now(&self) -> SimTime;

    fn set_now(&mut self, now: SimTime);
}

/// Motors of the robot behind their gears, without load.
#[derive(Clone, PartialEq)]
pub struct Motors {
    pub now: SimTime,
    /// Time until which a part may run ahead.
    pub horizon: SimTime,
    moved_to: SimTime,
    /// Voltage and bridge of hip and knee of each leg.
    pub inputs: Vec<f64>,
    /// Positions of hip and knee of each leg \[rad\], then three angles and three forces each.
    pub outputs: Vec<f64>,
    rates: Vec<f64>,
    /// Whether the motors turn; otherwise they are locked.
    pub turning: bool,
    /// Maximum rate of each motor so far \[rad/s\].
    pub fastest: Vec<f64>,
}

const MOTORS: usize = 2 * LEGS.len();
const TORQUE_PER_VOLT: f64 = 14.05e-3 * 14.0 / 0.593;
const DAMPING: f64 = 14.05e-3 * 14.0 * 14.05e-3 * 14.0 / 0.593;
const INERTIA: f64 = 5.54e-7 * 196.0;

impl Motors {
    pub fn new() -> Self {
        Self {
            now: SimTime::ZERO,
            horizon: SimTime::ZERO,
            moved_to: SimTime::ZERO,
            inputs: vec![0.0; 2 * MOTORS],
            outputs: vec![0.0; MOTORS + 6 * LEGS.len()],
            rates: vec![0.0; MOTORS],
            turning: true,
            fastest: vec![0.0; MOTORS],
        }
    }

    pub fn signals() -> PlantSignals {
        Self::signals_of(&LEGS)
    }

    pub fn signals_of(legs: &[&str]) -> PlantSignals {
        let mut ports = Vec::new();
        for leg in legs {
            for joint in ["hip", "knee"] {
                let name = |what: &str| format!("leg/{leg}/{joint}/{what}");
                ports.push(Port::input(name("voltage"), Unit::Volt, 1));
                ports.push(Port::input(name("bridge"), Unit::One, 1));
                ports.push(Port::output(name("position"), Unit::Radian, 1));
            }
        }
        for leg in legs {
            ports.push(Port::output(format!("leg/{leg}/angles"), Unit::Radian, 3));
            ports.push(Port::output(
                format!("leg/{leg}/foot/force"),
                Unit::Newton,
                3,
            ));
        }
        PlantSignals::of(&ports)
    }

    fn advance_to_now(&mut self) {
        if self.moved_to == self.now {
            return;
        }
        let seconds = (self.now - self.moved_to).as_secs_f64();
        self.moved_to = self.now;
        if !self.turning {
            return;
        }
        for n in 0..MOTORS {
            let (volts, bridge) = (self.inputs[2 * n], self.inputs[2 * n + 1]);
            let voltage = (bridge != 0.0).then_some(volts);
            turn(&mut self.outputs[n], &mut self.rates[n], voltage, seconds);
            self.fastest[n] = self.fastest[n].max(self.rates[n].abs());
        }
    }
}

/// Turns a motor of the robot behind its gear, exactly, with a constant voltage or, without one,
/// freely.
pub fn turn(position: &mut f64, rate: &mut f64, voltage: Option<f64>, seconds: f64) {
    let Some(volts) = voltage else {
        *position += *rate * seconds;
        return;
    };
    let end = volts * TORQUE_PER_VOLT / DAMPING;
    let tau = INERTIA / DAMPING;
    let rest = libm::exp(-seconds / tau);
    *position += end * seconds + (*rate - end) * tau * (1.0 - rest);
    *rate = end + (*rate - end) * rest;
}

impl Plant for Motors {
    fn now(&self) -> SimTime {
        self.now
    }

    fn set_now(&mut self, now: SimTime) {
        self.now = now;
    }
}

impl PlantAccess for Motors {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        self.advance_to_now();
        Ok(&self.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        self.advance_to_now();
        Ok(&mut self.inputs[signals])
    }

    fn run_ahead(&mut self, to: SimTime) -> bool {
        let ahead = self.now < to && to <= self.horizon;
        if ahead {
            self.now = to;
        }
        ahead
    }
}

/// Saved state of a harness.
#[derive(PartialEq)]
pub struct Saved<P = Motors> {
    task: Snapshot,
    plant: P,
    wake: Option<SimTime>,
    busy: bool,
}

/// Harness of a running bus.
pub struct Harness<P = Motors> {
    pub task: WiredTask,
    pub plant: P,
    wake: Option<SimTime>,
    pub busy: bool,
    /// Number of wake-ups.
    pub woken: u64,
    /// Bytes on the traces, with time and trace; recorded only if `Some`.
    pub passed: Option<Vec<(SimTime, usize, Vec<u8>)>>,
}

impl Harness {
    pub fn new(config: &BusConfig) -> Self {
        Self::with_plant(config, &Motors::signals(), Motors::new())
    }

    /// A bus with further boards, which the host does not use, and locked motors.
    pub fn with_unused_boards(count: usize) -> Self {
        let mut config = BusConfig::default();
        let names: Vec<String> = (0..count).map(|n| format!("X{n}")).collect();
        for (name, id) in names.iter().zip(5..) {
            let board = BoardConfig {
                name: name.clone(),
                id,
                used: false,
                ..BoardConfig::default()
            };
            let phase = SimDuration::from_micros(u64::from(id) * 17 % 1_000);
            config.boards.push(board.with_clock(0, phase).unwrap());
        }
        let legs: Vec<&str> = LEGS
            .into_iter()
            .chain(names.iter().map(String::as_str))
            .collect();
        let signals = Motors::signals_of(&legs);
        let mut plant = Motors::new();
        plant.turning = false;
        plant.inputs.resize(signals.inputs.len(), 0.0);
        plant.outputs.resize(signals.outputs.len(), 0.0);
        Self::with_plant(&config, &signals, plant)
    }
}

impl<P: Plant> Harness<P> {
    pub fn with_plant(config: &BusConfig, signals: &PlantSignals, plant: P) -> Self {
        let driver = Box::new(Bus::driver(config).unwrap());
        let wire = Box::new(Bus::wire(config).unwrap());
        let mut task = WiredTask::new(driver, wire);
        task.connect("sbcp", signals).unwrap();
        Self {
            task,
            plant,
            wake: None,
            busy: false,
            woken: 0,
            passed: None,
        }
    }

    pub fn now(&self) -> SimTime {
        self.plant.now()
    }

    fn follow(&mut self, progress: Result<Progress, TaskError>) -> Result<(), String> {
        match progress.map_err(|error| error.to_string())? {
            Progress::WakeAt(at) => {
                self.busy = true;
                self.wake = Some(at);
            }
            Progress::Done => {
                self.busy = false;
                self.wake = self.task.idle_wake();
            }
        }
        let (now, passed) = (self.plant.now(), &mut self.passed);
        self.task.drain_traffic(&mut |trace, bytes| {
            if let Some(passed) = passed {
                passed.push((now, trace, bytes.to_vec()));
            }
        });
        Ok(())
    }

    /// Executes the next event if it is not later than `limit`.
    pub fn step(&mut self, limit: SimTime) -> Result<bool, String> {
        let Some(at) = self.wake.filter(|at| *at <= limit) else {
            self.plant.set_now(self.now().max(limit));
            return Ok(false);
        };
        assert!(at >= self.now(), "time decreases");
        self.plant.set_now(at);
        self.woken += 1;
        let progress = self.task.wake(at, &mut self.plant);
        self.follow(progress)?;
        Ok(true)
    }

    pub fn run_until(&mut self, limit: SimTime) -> Result<(), String> {
        while self.step(limit)? {}
        Ok(())
    }

    /// Runs until the task is idle, but not beyond `limit`.
    pub fn run_until_idle(&mut self, limit: SimTime) -> Result<(), String> {
        while self.busy {
            if !self.step(limit)? {
                return Err(format!("still busy at {limit}"));
            }
        }
        Ok(())
    }

    /// Opens the bus and returns the duration.
    pub fn open(&mut self) -> Result<SimDuration, String> {
        let now = self.now();
        self.open_until(now)?;
        self.run_until_idle(now + SimDuration::from_secs(20))?;
        Ok(self.now() - now)
    }

    /// Starts opening.
    pub fn open_until(&mut self, limit: SimTime) -> Result<(), String> {
        let progress = self.task.open(self.plant.now(), &mut self.plant);
        self.follow(progress)?;
        self.run_until(limit)
    }

    /// Starts a transfer.
    pub fn begin(&mut self, commands: &[f64]) -> Result<(), String> {
        let now = self.now();
        let progress = self.task.begin(now, commands, &mut self.plant);
        self.follow(progress)
    }

    /// Runs one transfer per period, from the next whole period until `to`, skipping those for
    /// which the bus is busy. Returns their number.
    pub fn run_cycles<const N: usize>(
        &mut self,
        period: SimDuration,
        to: SimTime,
        mut commands: impl FnMut(SimTime) -> [f64; N],
    ) -> Result<u64, String> {
        let mut cycles = 0;
        let period_ns = period.as_nanos();
        let next = self.now().as_nanos() / period_ns + 1;
        let mut at = SimTime::from_nanos(next * period_ns);
        while at <= to {
            self.run_until(at)?;
            if !self.busy {
                cycles += 1;
                self.begin(&commands(at))?;
            }
            at += period;
        }
        self.run_until(to)?;
        Ok(cycles)
    }

    /// Returns the times at which the host wrote the request of a cycle to the first board, from
    /// the recorded bytes.
    pub fn cycle_begins(&self) -> Vec<SimTime> {
        let passed = self.passed.iter().flatten();
        let first = |(_, trace, bytes): &&(SimTime, usize, Vec<u8>)| {
            *trace == 0 && matches!(bytes[..], [0xFF, _, 1, _, 0x10, ..])
        };
        passed.filter(first).map(|(at, ..)| *at).collect()
    }

    pub fn diagnostics(&self) -> Vec<(String, f64)> {
        let ports = self.task.diagnostics();
        let mut values = vec![0.0; ports.len()];
        self.task.read_diagnostics(self.now(), &mut values);
        ports
            .into_iter()
            .map(|port| port.name)
            .zip(values)
            .collect()
    }

    pub fn diagnostic(&self, name: &str) -> f64 {
        let diagnostics = self.diagnostics();
        let found = diagnostics.iter().find(|(known, _)| known == name);
        found.unwrap_or_else(|| panic!("no diagnostic {name}")).1
    }

    /// Saves the complete state.
    pub fn save(&self) -> Saved<P> {
        Saved {
            task: self.task.save(),
            plant: self.plant.clone(),
            wake: self.wake,
            busy: self.busy,
        }
    }

    pub fn try_restore(&mut self, saved: &Saved<P>) -> Result<(), SnapshotError> {
        self.task.restore(&saved.task)
    }

    pub fn restore(&mut self, saved: &Saved<P>) {
        self.try_restore(saved).unwrap();
        self.plant = saved.plant.clone();
        self.wake = saved.wake;
        self.busy = saved.busy;
    }
}

/// Sets the clock rates of the boards \[ppb fast\] and the phases of their ticks.
pub fn with_clocks(
    mut config: BusConfig,
    rates_ppb: [i64; 4],
    phases: [SimDuration; 4],
) -> BusConfig {
    for ((board, rate), phase) in config.boards.iter_mut().zip(rates_ppb).zip(phases) {
        *board = board.clone().with_clock(rate, phase).unwrap();
    }
    config
}
