//! Test bench of motors.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimTime, Snapshot, SnapshotError, Unit, signal};
use twinrig_runtime::{EnergyBalance, Ledger, Plant, PlantFault, PlantState, WorkCounts};

use super::cache::Cache;
use super::error::{DrivesError, reject_duplicates};
use super::shaft::{Drive, Shaft, ShaftModel};

/// Joints of a leg that have a motor, in the order of the ports.
const JOINTS: [&str; 2] = ["hip", "knee"];

/// Motors of a test bench.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchMotors {
    /// Names of the legs whose motors are present.
    pub legs: Vec<String>,
    /// Shafts of the hips.
    pub hip: Shaft,
    /// Shafts of the knees.
    pub knee: Shaft,
}

/// Test bench of the motors of legs: a plant named `drives`, with these ports:
///
/// | port | |
/// |---|---|
/// | `leg/LF/hip/voltage`, `…/bridge` | inputs \[V\], \[1\], as of a robot; `knee` likewise |
/// | `leg/LF/hip/position`, `…/rate` | \[rad\], \[rad/s\], behind the gear |
/// | `leg/LF/hip/torque` | motor torque at the output, mean over the last step \[N·m\] |
/// | `leg/LF/angles` | hip, 0, 0: joint angles of a leg with the hip only \[rad\] |
/// | `energy/…` | as of a robot; spring, gravity and impact energies are zero \[J\] |
///
/// All shafts start at rest at zero, and coast until a bridge closes. Each is advanced only where
/// its inputs change or it is read, and all at the observations; its torque is the mean since then.
#[derive(Debug, Clone)]
pub struct MotorBench {
    models: [ShaftModel; 2],
    legs: Vec<String>,
    /// Hip and knee of each leg in turn, each advanced only when its inputs change or it is
    /// observed.
    shafts: Vec<ShaftState>,
    drives: Vec<Drive>,
    /// Last inputs of the shafts.
    inputs: Vec<f64>,
    cache: Cache,
    now: SimTime,
    ledger: Ledger,
    steps: u64,
    ports: Vec<Port>,
    signals: Vec<Signal>,
}

/// State of a shaft.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct ShaftState {
    position: f64,
    rate: f64,
    /// Mean over the last step \[N·m\].
    torque: f64,
    /// Time to which it is advanced.
    at: SimTime,
}

/// Value of an output.
#[derive(Debug, Clone, Copy)]
enum Signal {
    /// With the index in [`signal::ENERGY`].
    Energy(usize),
    Position(usize),
    Rate(usize),
    Torque(usize),
    Zero,
}

/// Serialised state.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    shafts: Vec<ShaftState>,
    inputs: Vec<f64>,
    ledger: Ledger,
    steps: u64,
}

/// Values of a measurement of a leg whose hip shaft has an index; only the first, if it has one.
type LegSignal = fn(usize) -> [Signal; 3];

/// Measurements of a leg by their standard names. The knee shaft follows the hip shaft.
const LEG: [(&str, LegSignal); 7] = [
    (signal::HIP_POSITION, |hip| one(Signal::Position(hip))),
    (signal::HIP_RATE, |hip| one(Signal::Rate(hip))),
    (signal::HIP_TORQUE, |hip| one(Signal::Torque(hip))),
    (signal::KNEE_POSITION, |hip| one(Signal::Position(hip + 1))),
    (signal::KNEE_RATE, |hip| one(Signal::Rate(hip + 1))),
    (signal::KNEE_TORQUE, |hip| one(Signal::Torque(hip + 1))),
    ("angles", |hip| one(Signal::Position(hip))),
];

const fn one(signal: Signal) -> [Signal; 3] {
    [signal, Signal::Zero, Signal::Zero]
}

impl MotorBench {
    /// The ports of the motors of these legs, all outputs included.
    pub fn ports_of(legs: &[String]) -> Vec<Port> {
        signals(legs, &|_| true).0
    }

    /// Creates the bench with all shafts at rest. `requested` selects the output signals.
    ///
    /// # Errors
    /// [`DrivesError`] for duplicate legs, and for invalid motors or loads.
    pub fn new(
        bench_motors: &BenchMotors,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Self, DrivesError> {
        reject_duplicates(&bench_motors.legs)?;
        let models = [
            ShaftModel::new("hip", &bench_motors.hip)?,
            ShaftModel::new("knee", &bench_motors.knee)?,
        ];
        let (ports, signals) = signals(&bench_motors.legs, requested);
        let count = JOINTS.len() * bench_motors.legs.len();
        let coasting = |shaft: usize| models[shaft % JOINTS.len()].drive(0.0, 0.0);
        Ok(Self {
            shafts: vec![ShaftState::default(); count],
            drives: (0..count).map(coasting).collect(),
            inputs: vec![0.0; 2 * count],
            models,
            legs: bench_motors.legs.clone(),
            cache: Cache::new(),
            now: SimTime::ZERO,
            ledger: Ledger::opened([0.0; 3]),
            steps: 0,
            ports,
            signals,
        })
    }

    /// Returns the names of position and rate of each shaft.
    fn shaft_names(&self) -> Vec<[String; 2]> {
        let legs = self.legs.iter();
        let joints = legs.flat_map(|leg| {
            [
                [signal::HIP_POSITION, signal::HIP_RATE],
                [signal::KNEE_POSITION, signal::KNEE_RATE],
            ]
            .map(|names| names.map(|name| signal::of_leg(leg, name)))
        });
        joints.collect()
    }

    /// Kinetic energy of all shafts \[J\].
    fn kinetic(&self) -> f64 {
        let models = self.models.iter().cycle();
        let shafts = self.shafts.iter().zip(models);
        shafts
            .map(|(shaft, model)| 0.5 * model.inertia() * shaft.rate * shaft.rate)
            .sum()
    }

    /// Sets the inputs of the shafts whose inputs differ from the last ones, from now on.
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), PlantFault> {
        for (i, inputs) in inputs.as_chunks::<2>().0.iter().enumerate() {
            if *inputs == self.inputs.as_chunks().0[i] {
                continue;
            }
            if let Some(n) = inputs.iter().position(|input| !input.is_finite()) {
                let port = self.ports.get(2 * i + n);
                return Err(PlantFault {
                    time: self.now,
                    part: port.map(|port| port.name.clone()).unwrap_or_default(),
                    energy: self.energy().stored(),
                    why: "the input is not a number".to_owned(),
                });
            }
            self.advance_shaft(i);
            self.inputs[2 * i..2 * i + 2].copy_from_slice(inputs);
            self.drives[i] = self.models[i % JOINTS.len()].drive(inputs[0], inputs[1]);
        }
        Ok(())
    }

    /// Advances a shaft to now.
    fn advance_shaft(&mut self, i: usize) -> &ShaftState {
        let (shaft, drive) = (&mut self.shafts[i], &self.drives[i]);
        if shaft.at == self.now {
            return shaft;
        }
        let elapsed = self.now - shaft.at;
        shaft.at = self.now;
        if shaft.rate == 0.0 && drive.coasts() {
            shaft.torque = 0.0;
            return shaft;
        }
        let joint = i % JOINTS.len();
        let model = &self.models[joint];
        let (seconds, responses) = self.cache.find(elapsed, &self.models);
        let step = model.step(drive, shaft.rate, &responses[joint], seconds);
        shaft.position += step.travel;
        shaft.rate = step.rate;
        shaft.torque = step.torque;
        self.ledger.actuator += step.motor_work;
        self.ledger.dissipated += step.friction_work;
        shaft
    }

    /// Advances all shafts to now.
    fn advance_shafts(&mut self) {
        for i in 0..self.shafts.len() {
            self.advance_shaft(i);
        }
        self.ledger.close_step([self.kinetic(), 0.0, 0.0]);
    }

    /// Returns the bench with all shafts advanced to now.
    fn advanced(&self) -> Self {
        let mut bench = self.clone();
        bench.advance_shafts();
        bench
    }

    /// Computes the torque-rate lines of the shafts from their inputs.
    fn update_drives(&mut self) {
        let pairs = self.inputs.chunks_exact(2).zip(&mut self.drives);
        for (i, (inputs, drive)) in pairs.enumerate() {
            *drive = self.models[i % JOINTS.len()].drive(inputs[0], inputs[1]);
        }
    }
}

/// Inputs of hip and knee, leg by leg; then the requested measurements, as ports and as the signals
/// of their values.
fn signals(legs: &[String], requested: &dyn Fn(&str) -> bool) -> (Vec<Port>, Vec<Signal>) {
    let mut ports = Vec::new();
    for leg in legs {
        for joint in JOINTS {
            for (what, unit) in [("voltage", Unit::Volt), ("bridge", Unit::One)] {
                let name = signal::of_leg(leg, &format!("{joint}/{what}"));
                ports.push(Port::input(name, unit, 1));
            }
        }
    }
    let mut signals = Vec::new();
    let mut offer = |port: Port, values: [Signal; 3]| {
        if requested(&port.name) {
            signals.extend_from_slice(&values[..port.size]);
            ports.push(port);
        }
    };
    for (index, standard) in signal::ENERGY.iter().enumerate() {
        offer(standard.output(), one(Signal::Energy(index)));
    }
    for (i, leg) in legs.iter().enumerate() {
        for (name, measured) in LEG {
            let mut standards = signal::LEG.iter();
            if let Some(standard) = standards.find(|standard| standard.name == name) {
                offer(standard.output_of_leg(leg), measured(JOINTS.len() * i));
            }
        }
    }
    (ports, signals)
}

impl Plant for MotorBench {
    fn name(&self) -> &'static str {
        "drives"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.set_inputs(inputs)?;
        self.now = to;
        self.steps += 1;
        let checked = self.ledger.check();
        checked.map_err(|why| PlantFault {
            time: self.now,
            part: "integrator".to_owned(),
            energy: self.energy().stored(),
            why: why.to_string(),
        })
    }

    /// Advances all shafts, so that the motion does not depend on the signals requested.
    fn observe(&mut self, outputs: &mut [f64]) {
        self.advance_shafts();
        let all = 0..outputs.len();
        self.observe_signals(all, outputs);
    }

    fn observe_signals(&mut self, signals: Range<usize>, outputs: &mut [f64]) -> bool {
        for place in signals {
            outputs[place] = match self.signals[place] {
                Signal::Energy(index) => self.energy().values()[index],
                Signal::Position(shaft) => self.advance_shaft(shaft).position,
                Signal::Rate(shaft) => self.advance_shaft(shaft).rate,
                Signal::Torque(shaft) => self.advance_shaft(shaft).torque,
                Signal::Zero => 0.0,
            };
        }
        false
    }

    fn energy(&self) -> EnergyBalance {
        if self.shafts.iter().all(|shaft| shaft.at == self.now) {
            return self.ledger.balance();
        }
        self.advanced().ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        WorkCounts::of_steps(self.steps)
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            shafts: self.shafts.clone(),
            inputs: self.inputs.clone(),
            ledger: self.ledger,
            steps: self.steps,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        let inputs = self.ports.iter();
        let inputs = inputs.filter(|port| port.direction == Direction::Input);
        if saved.shafts.len() != self.shafts.len() || saved.inputs.len() != inputs.count() {
            return Err(SnapshotError::Mismatch {
                expected: format!("{} motors", self.shafts.len()),
                found: format!("{} motors", saved.shafts.len()),
            });
        }
        (self.now, self.shafts, self.inputs) = (saved.now, saved.shafts, saved.inputs);
        (self.ledger, self.steps) = (saved.ledger, saved.steps);
        self.update_drives();
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        let bench = self.advanced();
        let shafts = self.shaft_names().into_iter().zip(&bench.shafts);
        let state = PlantState::at(self.now);
        Some(shafts.fold(state, |state, ([position, rate], shaft)| {
            state
                .with(position, &[shaft.position])
                .with(rate, &[shaft.rate])
        }))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let names = self.shaft_names();
        let mut lines = Vec::new();
        for (names, shaft) in names.iter().zip(&mut self.shafts) {
            (shaft.torque, shaft.at) = (0.0, from.time);
            for (name, value) in names.iter().zip([&mut shaft.position, &mut shaft.rate]) {
                match from.get(name) {
                    Some(&[found]) if found.is_finite() => *value = found,
                    _ => lines.push(format!("{name} is missing and keeps its value")),
                }
            }
        }
        let unknown = from
            .iter()
            .filter(|(name, _)| !names.as_flattened().iter().any(|known| known == name));
        lines.extend(unknown.map(|(name, _)| format!("{name} is not a state of this plant")));
        self.inputs.fill(0.0);
        self.update_drives();
        (self.now, self.steps) = (from.time, 0);
        self.ledger = Ledger::opened([self.kinetic(), 0.0, 0.0]);
        Ok(lines)
    }
}
