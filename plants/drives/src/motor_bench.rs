//! Motors on a bench.

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_legged::Ledger;
use twinrig_runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};

use crate::cache::Cache;
use crate::error::{DrivesError, once};
use crate::shaft::{Drive, Fixture, Shaft};

/// Joints of a leg that have a motor, in the order of the ports.
const JOINTS: [&str; 2] = ["hip", "knee"];

/// What is on a bench.
#[derive(Debug, Clone, PartialEq)]
pub struct Motored {
    /// The legs whose motors are there.
    pub legs: Vec<String>,
    /// The hips' motors, and what hangs at them.
    pub hip: Shaft,
    /// The knees'.
    pub knee: Shaft,
}

/// The motors of legs that are not there. A plant by the name of `drives`:
///
/// | port | |
/// |---|---|
/// | `leg/LF/hip/voltage`, `leg/LF/hip/bridge` | inputs \[V\], \[1\], as of a robot that is driven by motors; `knee` likewise |
/// | `leg/LF/hip/position`, `…/rate` | \[rad\], \[rad/s\], behind the gear |
/// | `leg/LF/hip/torque` | of the motor at the output, mean over the last step \[N·m\] |
/// | `leg/LF/angles` | hip, 0, 0: the joints of a leg that has none but the hip \[rad\] |
/// | `energy/…` | as of a robot; of springs, height and impacts there is none \[J\] |
///
/// All start at rest at zero, and coast until a bridge closes.
#[derive(Debug, Clone)]
pub struct MotorBench {
    fixtures: [Fixture; 2],
    /// Hip and knee of each leg in turn.
    shafts: Vec<Turning>,
    drives: Vec<Drive>,
    /// What the shafts were given last.
    inputs: Vec<f64>,
    cache: Cache,
    now: SimTime,
    ledger: Ledger,
    steps: u64,
    ports: Vec<Port>,
    wanted: Vec<Signal>,
}

/// A shaft in motion.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Turning {
    position: f64,
    rate: f64,
    /// Mean over the last step.
    torque: f64,
}

/// A measurement that somebody wants.
#[derive(Debug, Clone, Copy)]
enum Signal {
    Energy(Entry),
    Position(usize),
    Rate(usize),
    Torque(usize),
    /// Of the leg whose hip is there.
    Angles(usize),
}

/// Everything the way ahead depends on.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    shafts: Vec<Turning>,
    inputs: Vec<f64>,
    ledger: Ledger,
    steps: u64,
}

/// An entry of the books.
type Entry = fn(&EnergyBalance) -> f64;

const ENERGY: [(&str, Entry); 8] = [
    ("energy/kinetic", |balance| balance.kinetic),
    ("energy/spring", |balance| balance.spring),
    ("energy/gravity", |balance| balance.gravity),
    ("energy/dissipated", |balance| balance.dissipated),
    ("energy/actuator", |balance| balance.actuator),
    ("energy/impact", |balance| balance.impact),
    ("energy/exchanged", |balance| balance.exchanged),
    ("energy/residual", |balance| balance.residual),
];

/// A measurement of the shaft at a place.
type OfShaft = fn(usize) -> Signal;

const JOINT: [(&str, Unit, OfShaft); 3] = [
    ("position", Unit::Radian, Signal::Position),
    ("rate", Unit::RadianPerSecond, Signal::Rate),
    ("torque", Unit::NewtonMeter, Signal::Torque),
];

impl MotorBench {
    /// The ports of the motors of these legs, all outputs included.
    pub fn ports_of(legs: &[String]) -> Vec<Port> {
        signals(legs, &|_| true).0
    }

    /// The bench with everything at rest. `wanted` says which of the output signals anybody needs.
    ///
    /// # Errors
    /// [`DrivesError`] for a leg named twice, and for a motor or a load that cannot be.
    pub fn new(motored: &Motored, wanted: &dyn Fn(&str) -> bool) -> Result<Self, DrivesError> {
        once(&motored.legs)?;
        let fixtures = [
            Fixture::new("hip", &motored.hip)?,
            Fixture::new("knee", &motored.knee)?,
        ];
        let (ports, wanted) = signals(&motored.legs, wanted);
        let count = JOINTS.len() * motored.legs.len();
        let coasting = |shaft: usize| fixtures[shaft % JOINTS.len()].drive(0.0, 0.0);
        Ok(Self {
            shafts: vec![Turning::default(); count],
            drives: (0..count).map(coasting).collect(),
            inputs: vec![0.0; 2 * count],
            fixtures,
            cache: Cache::new(),
            now: SimTime::ZERO,
            ledger: Ledger::opened([0.0; 3]),
            steps: 0,
            ports,
            wanted,
        })
    }

    /// Takes inputs that are others than before.
    fn follow_command(&mut self, inputs: &[f64]) -> Result<(), PlantFault> {
        if let Some(i) = inputs.iter().position(|input| !input.is_finite()) {
            let mut ports = self.ports.iter();
            let port = ports.nth(i).map(|port| port.name.clone());
            return Err(PlantFault {
                time: self.now,
                part: port.unwrap_or_default(),
                energy: self.energy().stored(),
                why: "the input is not a number".to_owned(),
            });
        }
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        self.drive();
        Ok(())
    }

    /// What the shafts do under their inputs.
    fn drive(&mut self) {
        let given = self.inputs.chunks_exact(2).zip(&mut self.drives);
        for (i, (given, drive)) in given.enumerate() {
            *drive = self.fixtures[i % JOINTS.len()].drive(given[0], given[1]);
        }
    }
}

/// Inputs of hip and knee, leg by leg; then the measurements that are wanted, by port and by what they are.
fn signals(legs: &[String], wanted: &dyn Fn(&str) -> bool) -> (Vec<Port>, Vec<Signal>) {
    let mut ports = Vec::new();
    for leg in legs {
        for joint in JOINTS {
            for (what, unit) in [("voltage", Unit::Volt), ("bridge", Unit::One)] {
                ports.push(Port::input(format!("leg/{leg}/{joint}/{what}"), unit, 1));
            }
        }
    }
    let mut signals = Vec::new();
    let mut offer = |name: &str, unit: Unit, size: usize, signal: Signal| {
        if wanted(name) {
            ports.push(Port::output(name, unit, size));
            signals.push(signal);
        }
    };
    for (name, of) in ENERGY {
        offer(name, Unit::Joule, 1, Signal::Energy(of));
    }
    for (i, leg) in legs.iter().enumerate() {
        for (j, joint) in JOINTS.into_iter().enumerate() {
            for (what, unit, signal) in JOINT {
                let shaft = JOINTS.len() * i + j;
                offer(&format!("leg/{leg}/{joint}/{what}"), unit, 1, signal(shaft));
            }
        }
        let hip = Signal::Angles(JOINTS.len() * i);
        offer(&format!("leg/{leg}/angles"), Unit::Radian, 3, hip);
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
        if inputs != self.inputs {
            self.follow_command(inputs)?;
        }
        let (seconds, responses) = self.cache.find(to - self.now, &self.fixtures);
        let mut kinetic = 0.0;
        for (i, (shaft, drive)) in self.shafts.iter_mut().zip(&self.drives).enumerate() {
            if shaft.rate == 0.0 && drive.coasts() {
                shaft.torque = 0.0;
                continue;
            }
            let joint = i % JOINTS.len();
            let fixture = &self.fixtures[joint];
            let turn = fixture.turn(drive, shaft.rate, &responses[joint], seconds);
            shaft.position += turn.turned;
            shaft.rate = turn.rate;
            shaft.torque = turn.torque;
            self.ledger.actuator += turn.given;
            self.ledger.dissipated += turn.taken;
            kinetic += 0.5 * fixture.inertia() * turn.rate * turn.rate;
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
        let mut place = 0;
        for signal in &self.wanted {
            outputs[place] = match *signal {
                Signal::Energy(of) => of(&self.ledger.balance()),
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
        WorkCounts {
            steps: self.steps,
            ..WorkCounts::default()
        }
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
        self.drive();
        Ok(())
    }
}
