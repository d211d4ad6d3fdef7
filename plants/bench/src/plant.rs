//! Test bench as a plant.

use serde::{Deserialize, Serialize};
use twinrig_actuator::MotorLine;
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit, signal};
use twinrig_runtime::{
    EnergyBalance, Ledger, Plant, PlantEvent, PlantEventKind, PlantFault, PlantState, WorkCounts,
};

use crate::dynamics::{Event, Model, Point, Roller, State};
use crate::error::BenchError;
use crate::parameters::BenchParameters;

/// Default maximum step: halving it changes the load of the default bench at 4 Hz by less than
/// 1e-6 N.
pub const STEP: SimDuration = SimDuration::from_micros(250);

/// Name of the motor, and of the load of the sensor.
pub const MOTOR: &str = "cam";
/// Name of the load of the sensor.
pub const LOAD: &str = "bench/force";

/// Test bench of tactile sensors: a plant named `bench`, with these ports:
///
/// | port | |
/// |---|---|
/// | `motor/cam/voltage`, `…/bridge` | inputs \[V\], \[1\]: motor of the cam |
/// | `motor/cam/position`, `…/rate` | \[rad\], \[rad/s\], behind the gear |
/// | `motor/cam/torque` | torque of the motor at the output \[N·m\] |
/// | `bench/force`, `bench/force/rate` | load of sensor and reference cell \[N\], \[N/s\] |
/// | `bench/lift` | position of the carriage \[m\] |
/// | `bench/roller/force` | of the cam on the roller \[N\] |
/// | `bench/roller/clearance` | distance of the roller from the cam \[m\] |
/// | `energy/…` | energy balance; there is no gravity \[J\] |
///
/// Events, `bench/roller` and `bench/sensor`: the roller lands on the cam (`Reached`) or leaves it,
/// the sensor is touched or released.
#[derive(Debug)]
pub struct Bench {
    model: Model,
    point: Point,
    line: MotorLine,
    inputs: [f64; 2],
    step: SimDuration,
    now: SimTime,
    ledger: Ledger,
    work: WorkCounts,
    events: Vec<PlantEvent>,
    log: bool,
    ports: Vec<Port>,
    signals: Vec<Signal>,
}

/// Requested measurement.
#[derive(Clone, Copy, Debug)]
enum Signal {
    Position,
    Rate,
    Torque,
    Force,
    ForceRate,
    Lift,
    RollerForce,
    Clearance,
    /// With the index in [`signal::ENERGY`].
    Energy(usize),
}

const MEASURED: [(&str, Unit, Signal); 8] = [
    ("motor/cam/position", Unit::Radian, Signal::Position),
    ("motor/cam/rate", Unit::RadianPerSecond, Signal::Rate),
    ("motor/cam/torque", Unit::NewtonMeter, Signal::Torque),
    (LOAD, Unit::Newton, Signal::Force),
    ("bench/force/rate", Unit::NewtonPerSecond, Signal::ForceRate),
    ("bench/lift", Unit::Meter, Signal::Lift),
    ("bench/roller/force", Unit::Newton, Signal::RollerForce),
    ("bench/roller/clearance", Unit::Meter, Signal::Clearance),
];

/// Names of the state.
const ANGLE: &str = "motor/cam/position";
const RATE: &str = "motor/cam/rate";
const LIFT: &str = "bench/lift";
const LIFT_RATE: &str = "bench/lift/rate";

/// Events of one advance beyond which the roller counts as chattering.
const EVENTS_MAX: u32 = 1_000;

#[derive(Serialize, Deserialize)]
struct Saved {
    state: State,
    inputs: [f64; 2],
    now: SimTime,
    ledger: Ledger,
    work: WorkCounts,
}

impl Bench {
    /// Returns the ports, all outputs included.
    pub fn ports_of() -> Vec<Port> {
        signals(&|_| true).0
    }

    /// Creates the bench at rest at the lowest point of the cam. `requested` selects the outputs,
    /// the seed determines the scratches of the cam, `step` is the maximum step.
    ///
    /// # Errors
    /// [`BenchError`] for an invalid motor or step.
    pub fn new(
        parameters: &BenchParameters,
        step: SimDuration,
        seed: u64,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Self, BenchError> {
        if step.is_zero() {
            return Err(BenchError::Step);
        }
        let model = Model::new(parameters, seed)?;
        let line = model.motor.line(0.0, 0.0);
        let point = model.point(&line, model.at_rest());
        let [kinetic, spring] = model.stored(&point.state);
        let (ports, signals) = signals(requested);
        Ok(Self {
            line,
            model,
            point,
            inputs: [0.0; 2],
            step,
            now: SimTime::ZERO,
            ledger: Ledger::opened([kinetic, spring, 0.0]),
            work: WorkCounts::default(),
            events: Vec::new(),
            log: false,
            ports,
            signals,
        })
    }

    /// Cam rate from which the roller leaves a harmonic cam at its top, without friction \[rad/s\]:
    /// √(2 k (lift + preload)/(m lift)); none if the springs are never compressed.
    pub fn separation_rate(parameters: &BenchParameters) -> Option<f64> {
        let carriage = &parameters.carriage;
        let lift = parameters.cam.profile.lift();
        let springs = 2.0 * carriage.stiffness * (lift + carriage.preload);
        (springs > 0.0 && lift > 0.0).then(|| (springs / (carriage.mass * lift)).sqrt())
    }

    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), PlantFault> {
        let [voltage, bridge] = [inputs[0], inputs[1]];
        for (input, name) in [(voltage, "voltage"), (bridge, "bridge")] {
            if !input.is_finite() {
                return Err(self.fault(&format!("motor/cam/{name}"), "the input is not a number"));
            }
        }
        self.inputs = [voltage, bridge];
        self.set_line();
        Ok(())
    }

    /// Computes the torque-rate line of the motor from the inputs.
    fn set_line(&mut self) {
        let [voltage, bridge] = self.inputs;
        self.line = self.model.motor.line(voltage, bridge);
        self.point = self.model.point(&self.line, self.point.state);
    }

    fn fault(&self, part: &str, why: &str) -> PlantFault {
        PlantFault {
            time: self.now,
            part: part.to_owned(),
            energy: self.energy().stored(),
            why: why.to_owned(),
        }
    }

    /// Advances by a step \[s\] that began at `at_s`, through its events.
    fn step(&mut self, mut at_s: f64, seconds: f64) -> Result<(), PlantFault> {
        let mut left = seconds;
        for _ in 0..EVENTS_MAX {
            let (advanced, event, steps) = self.model.advance(&self.line, &mut self.point, left);
            self.work.steps += steps;
            let Some(event) = event else {
                return Ok(());
            };
            left -= advanced;
            at_s += advanced;
            self.work.events += 1;
            self.ledger.impact += self.model.switch(&self.line, &mut self.point, event);
            if self.log {
                self.events.push(logged(at_s, event));
            }
        }
        Err(self.fault("bench/roller", "the roller chatters on the cam"))
    }
}

fn logged(at_s: f64, event: Event) -> PlantEvent {
    let (part, kind) = match event {
        Event::Leaves => ("bench/roller", PlantEventKind::Released),
        Event::Lands => ("bench/roller", PlantEventKind::Reached),
        Event::Touches => ("bench/sensor", PlantEventKind::Reached),
        Event::Releases => ("bench/sensor", PlantEventKind::Released),
    };
    PlantEvent {
        at_s,
        part: part.to_owned(),
        kind,
    }
}

/// Inputs, then the requested measurements, as ports and as signals.
fn signals(requested: &dyn Fn(&str) -> bool) -> (Vec<Port>, Vec<Signal>) {
    let input = |what: &str, unit| Port::input(format!("motor/{MOTOR}/{what}"), unit, 1);
    let mut ports = vec![input("voltage", Unit::Volt), input("bridge", Unit::One)];
    let mut signals = Vec::new();
    let energies = signal::ENERGY.iter().enumerate();
    let energies = energies.map(|(index, standard)| (standard.output(), Signal::Energy(index)));
    let measured = MEASURED
        .iter()
        .map(|(name, unit, signal)| (Port::output(*name, *unit, 1), *signal));
    for (port, signal) in measured.chain(energies) {
        if requested(&port.name) {
            ports.push(port);
            signals.push(signal);
        }
    }
    (ports, signals)
}

impl Plant for Bench {
    fn name(&self) -> &'static str {
        "bench"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if inputs != self.inputs {
            self.set_inputs(inputs)?;
        }
        let (from, duration) = (self.now, to - self.now);
        let count = duration.as_nanos().div_ceil(self.step.as_nanos()).max(1);
        let seconds = duration.as_secs_f64() / count as f64;
        let begin_s = from.since_start().as_secs_f64();
        for n in 0..count {
            self.step(begin_s + n as f64 * seconds, seconds)?;
        }
        let [.., motor_work, friction_work] = self.point.state.values;
        (self.ledger.actuator, self.ledger.dissipated) = (motor_work, friction_work);
        let [kinetic, spring] = self.model.stored(&self.point.state);
        self.ledger.close_step([kinetic, spring, 0.0]);
        self.now = to;
        let checked = self.ledger.check();
        checked.map_err(|why| self.fault("integrator", &why.to_string()))
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let (model, state) = (&self.model, &self.point.state);
        for (output, signal) in outputs.iter_mut().zip(&self.signals) {
            *output = match *signal {
                Signal::Position => state.values[0],
                Signal::Rate => state.values[1],
                Signal::Torque => self.line.torque_at(state.values[1]),
                Signal::Force => model.load(state)[0],
                Signal::ForceRate => model.load(state)[1],
                Signal::Lift => state.values[2],
                Signal::RollerForce => self.point.roller_force,
                Signal::Clearance => model.clearance(state),
                Signal::Energy(index) => self.ledger.balance().values()[index],
            };
        }
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        WorkCounts {
            evaluations: 4 * self.work.steps,
            ..self.work
        }
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(match self.point.state.roller {
            Roller::OnCam => 0.0,
            Roller::Free => (-self.model.clearance(&self.point.state)).max(0.0),
        })
    }

    fn log_events(&mut self, enabled: bool) {
        self.log = enabled;
        self.events.clear();
    }

    fn events(&self) -> &[PlantEvent] {
        &self.events
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            state: self.point.state,
            inputs: self.inputs,
            now: self.now,
            ledger: self.ledger,
            work: self.work,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        (self.point.state, self.inputs) = (saved.state, saved.inputs);
        self.set_line();
        (self.now, self.ledger, self.work) = (saved.now, saved.ledger, saved.work);
        Ok(())
    }

    /// Angle and rate of the cam; position and velocity of the carriage while the roller is free.
    fn state(&self) -> Option<PlantState> {
        let State { roller, values } = self.point.state;
        let [angle, rate, position, velocity, ..] = values;
        let state = PlantState::at(self.now)
            .with(ANGLE, &[angle])
            .with(RATE, &[rate]);
        Some(match roller {
            Roller::OnCam => state,
            Roller::Free => state.with(LIFT, &[position]).with(LIFT_RATE, &[velocity]),
        })
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let value = |name: &str| match from.get(name) {
            Some(&[value]) if value.is_finite() => Some(value),
            _ => None,
        };
        let (Some(angle), Some(rate)) = (value(ANGLE), value(RATE)) else {
            return Err(self.fault("motor/cam", "the state has no finite angle and rate of it"));
        };
        let carriage = value(LIFT).zip(value(LIFT_RATE));
        let (position, velocity) = carriage.unwrap_or_default();
        self.point.state = State {
            roller: if carriage.is_some() {
                Roller::Free
            } else {
                Roller::OnCam
            },
            values: [angle, rate, position, velocity, 0.0, 0.0],
        };
        self.inputs = [0.0; 2];
        self.set_line();
        let [kinetic, spring] = self.model.stored(&self.point.state);
        self.ledger = Ledger::opened([kinetic, spring, 0.0]);
        (self.now, self.work) = (from.time, WorkCounts::default());
        self.events.clear();
        let known = [ANGLE, RATE, LIFT, LIFT_RATE];
        let unknown = from.iter().filter(|(name, _)| !known.contains(name));
        let lines = unknown.map(|(name, _)| format!("{name} is not a state of this plant"));
        Ok(lines.collect())
    }
}
