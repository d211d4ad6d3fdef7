//! Test bench of motors.

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
/// All shafts start at rest at zero, and coast until a bridge closes.
#[derive(Debug, Clone)]
pub struct MotorBench {
    models: [ShaftModel; 2],
    legs: Vec<String>,
    /// Hip and knee of each leg in turn.
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
}

/// Requested measurement.
#[derive(Debug, Clone, Copy)]
enum Signal {
    /// With the index in [`signal::ENERGY`].
    Energy(usize),
    Position(usize),
    Rate(usize),
    Torque(usize),
    /// Of the leg whose hip has this index.
    Angles(usize),
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

/// Measurement of a leg whose hip shaft has an index.
type LegSignal = fn(usize) -> Signal;

/// Measurements of a leg by their standard names. The knee shaft follows the hip shaft.
const LEG: [(&str, LegSignal); 7] = [
    (signal::HIP_POSITION, Signal::Position),
    (signal::HIP_RATE, Signal::Rate),
    (signal::HIP_TORQUE, Signal::Torque),
    (signal::KNEE_POSITION, |hip| Signal::Position(hip + 1)),
    (signal::KNEE_RATE, |hip| Signal::Rate(hip + 1)),
    (signal::KNEE_TORQUE, |hip| Signal::Torque(hip + 1)),
    ("angles", Signal::Angles),
];

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

    /// Sets the inputs of the shafts whose inputs differ from the last ones.
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), PlantFault> {
        let pairs = inputs.as_chunks().0.iter();
        let pairs = pairs.zip(self.inputs.as_chunks_mut::<2>().0);
        for (i, (inputs, last)) in pairs.enumerate() {
            if inputs == last {
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
            *last = *inputs;
            self.drives[i] = self.models[i % JOINTS.len()].drive(inputs[0], inputs[1]);
        }
        Ok(())
    }

    /// Computes the torque-rate lines of the shafts from their inputs.
    fn update_drives(&mut self) {
        let pairs = self.inputs.chunks_exact(2).zip(&mut self.drives);
        for (i, (inputs, drive)) in pairs.enumerate() {
            *drive = self.models[i % JOINTS.len()].drive(inputs[0], inputs[1]);
        }
    }
}

/// Inputs of hip and knee, leg by leg; then the requested measurements, as ports and as signals.
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
    let mut offer = |port: Port, signal: Signal| {
        if requested(&port.name) {
            ports.push(port);
            signals.push(signal);
        }
    };
    for (index, standard) in signal::ENERGY.iter().enumerate() {
        offer(standard.output(), Signal::Energy(index));
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
        let (seconds, responses) = self.cache.find(to - self.now, &self.models);
        let mut kinetic = 0.0;
        for (i, (shaft, drive)) in self.shafts.iter_mut().zip(&self.drives).enumerate() {
            if shaft.rate == 0.0 && drive.coasts() {
                shaft.torque = 0.0;
                continue;
            }
            let joint = i % JOINTS.len();
            let model = &self.models[joint];
            let step = model.step(drive, shaft.rate, &responses[joint], seconds);
            shaft.position += step.travel;
            shaft.rate = step.rate;
            shaft.torque = step.torque;
            self.ledger.actuator += step.motor_work;
            self.ledger.dissipated += step.friction_work;
            kinetic += 0.5 * model.inertia() * step.rate * step.rate;
        }
        self.ledger.close_step([kinetic, 0.0, 0.0]);
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

    fn observe(&mut self, outputs: &mut [f64]) {
        let balance = self.ledger.balance().values();
        let mut place = 0;
        for signal in &self.signals {
            outputs[place] = match *signal {
                Signal::Energy(index) => balance[index],
                Signal::Position(shaft) => self.shafts[shaft].position,
                Signal::Rate(shaft) => self.shafts[shaft].rate,
                Signal::Torque(shaft) => self.shafts[shaft].torque,
                Signal::Angles(hip) => {
                    outputs[place + 1..place + 3].fill(0.0);
                    place += 2;
                    outputs[place - 2] = self.shafts[hip].position;
                    0.0
                }
            };
            place += 1;
        }
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
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
        let shafts = self.shaft_names().into_iter().zip(&self.shafts);
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
            shaft.torque = 0.0;
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
