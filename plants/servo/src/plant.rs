//! A servo on its bench as a plant.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_actuator::serial::{Bridge, Firmware, FirmwareState, ServoCommand, duration};
use twinrig_kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit, signal};
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{EnergyBalance, Ledger, Plant, PlantFault, PlantState, WorkCounts};

use crate::error::ServoBenchError;
use crate::model::{Model, State};
use crate::parameters::ServoBenchParameters;

/// Servo that moves a mass on an arm: a plant named `servo`, with these ports:
///
/// | port | |
/// |---|---|
/// | `servo/command` | input: commanded position \[rad\] |
/// | `servo/enable` | input: torque on (not 0) or off \[1\] |
/// | `servo/angle`, `servo/rate` | of the shaft \[rad\], \[rad/s\] |
/// | `servo/reading` | angle as old as a position that is read now \[rad\] |
/// | `servo/position` | the same at a step of the controller, in counts of the encoder \[rad\] |
/// | `servo/duty` | duty cycle of the bridge, 0 with the torque off \[1\] |
/// | `servo/supply` | voltage of the supply behind its resistance \[V\] |
/// | `servo/current`, `servo/torque` | of the motor \[A\], \[N·m\] |
/// | `energy/…` | energy balance, at the last step of the controller \[J\] |
///
/// The controller works in steps of its period, from the start; a command is in force from the
/// first step after its delay. Between steps the duty cycle is constant.
#[derive(Debug)]
pub struct ServoBench {
    model: Model,
    firmware: Firmware,
    counts_per_radian: f64,
    reading_delay: SimDuration,
    now: SimTime,
    /// End of the last simulated period, not before `now`.
    tick: SimTime,
    state: State,
    bridge: Bridge,
    inputs: [f64; 2],
    /// Angle and rate at the ends of the last periods, the newest one last.
    past: VecDeque<[f64; 2]>,
    /// Number of periods that are kept in it.
    kept: usize,
    ledger: Ledger,
    work: WorkCounts,
    ports: Vec<Port>,
    signals: Vec<Signal>,
}

/// Requested output.
#[derive(Clone, Copy, Debug)]
enum Signal {
    Angle,
    Rate,
    Reading,
    Position,
    Duty,
    Supply,
    Current,
    Torque,
    /// With the index in [`signal::ENERGY`].
    Energy(usize),
}

const OUTPUTS: [(&str, Unit, Signal); 8] = [
    (ANGLE, Unit::Radian, Signal::Angle),
    (RATE, Unit::RadianPerSecond, Signal::Rate),
    ("servo/reading", Unit::Radian, Signal::Reading),
    ("servo/position", Unit::Radian, Signal::Position),
    ("servo/duty", Unit::One, Signal::Duty),
    ("servo/supply", Unit::Volt, Signal::Supply),
    ("servo/current", Unit::Ampere, Signal::Current),
    ("servo/torque", Unit::NewtonMeter, Signal::Torque),
];

const ANGLE: &str = "servo/angle";
const RATE: &str = "servo/rate";
/// Angle by which the motor is ahead of the arm \[rad\], and its rate \[rad/s\]: states of a gear
/// with backlash.
const LEAD: &str = "servo/motor/lead";
const MOTOR_RATE: &str = "servo/motor/rate";
/// Temperature of the winding above that of the start \[K\], a name of the state.
const RISE: &str = "servo/winding/temperature_rise";
const INPUTS: [(&str, Unit); 2] = [("servo/command", Unit::Radian), ("servo/enable", Unit::One)];

#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    tick: SimTime,
    state: State,
    bridge: Bridge,
    inputs: [f64; 2],
    past: VecDeque<[f64; 2]>,
    firmware: FirmwareState,
    ledger: Ledger,
    work: WorkCounts,
}

impl ServoBench {
    /// Returns the ports, all outputs included.
    pub fn ports_of() -> Vec<Port> {
        signals(&|_| true).0
    }

    /// Creates the bench at rest at angle 0, which is also the command in force, with the torque on
    /// and a cold winding. `requested` selects the outputs.
    ///
    /// # Errors
    /// [`ServoBenchError`] for a motor that is too stiff for the period of its controller.
    pub fn new(
        parameters: &ServoBenchParameters,
        requested: &dyn Fn(&str) -> bool,
    ) -> Result<Self, ServoBenchError> {
        let controller = &parameters.controller;
        let firmware = Firmware::new(controller, 0.0);
        let reading_delay = duration(controller.reading_delay);
        // The oldest one that is read, the one before it, and the one that is ahead of the present.
        let kept = reading_delay.as_nanos() / firmware.period().as_nanos() + 3;
        let kept = usize::try_from(kept).unwrap_or(usize::MAX);
        let (ports, signals) = signals(requested);
        let model = Model::new(parameters)?;
        let mut bench = Self {
            counts_per_radian: controller.counts as f64 / core::f64::consts::TAU,
            model,
            firmware,
            reading_delay,
            now: SimTime::ZERO,
            tick: SimTime::ZERO,
            state: State::default(),
            bridge: Bridge::Open,
            inputs: [0.0, 1.0],
            past: VecDeque::with_capacity(kept),
            kept,
            ledger: Ledger::opened([0.0; 3]),
            work: WorkCounts::default(),
            ports,
            signals,
        };
        bench.model.mesh(&mut bench.state, None);
        bench.restart();
        Ok(bench)
    }

    /// Returns the same bench with substeps of at most `longest`.
    ///
    /// # Errors
    /// Too many substeps.
    pub fn with_substep(mut self, longest: SimDuration) -> Result<Self, ServoBenchError> {
        let period = self.firmware.period();
        self.model.divide(period, longest)?;
        Ok(self)
    }

    /// Returns the length of a substep.
    pub fn substep(&self) -> SimDuration {
        self.firmware.period() / u64::from(self.model.substeps)
    }

    /// Begins at the present state.
    fn restart(&mut self) {
        self.past.clear();
        self.past.push_back([self.state.angle, self.state.rate]);
        let [kinetic, potential] = self.model.stored(&self.state);
        self.ledger = Ledger::opened([kinetic, 0.0, potential]);
        self.work = WorkCounts::default();
    }

    fn fault(&self, part: &str, why: &str) -> PlantFault {
        PlantFault {
            time: self.now,
            part: part.to_owned(),
            energy: self.energy().stored(),
            why: why.to_owned(),
        }
    }

    /// Advances by a period of the controller.
    fn period(&mut self) {
        self.bridge = self.firmware.step(self.tick, self.state.angle);
        let period = self.firmware.period();
        let advanced = self
            .model
            .advance(self.bridge, &mut self.state, period.as_secs_f64());
        let (works, counts) = advanced;
        self.work.steps += counts.steps;
        self.work.events += counts.events;
        self.work.evaluations += 2 * counts.steps;
        self.ledger.actuator += works.motor;
        self.ledger.dissipated += works.friction;
        if self.past.len() == self.kept {
            self.past.pop_front();
        }
        self.past.push_back([self.state.angle, self.state.rate]);
        self.tick += period;
    }

    /// Returns angle and rate at an instant not after the last simulated one, by the cubic through
    /// both at the steps around it.
    fn motion_at(&self, time: SimTime) -> [f64; 2] {
        let period = self.firmware.period();
        let age = self.tick - time.min(self.tick);
        let steps = usize::try_from(age.as_nanos() / period.as_nanos()).unwrap_or(usize::MAX);
        let newest = self.past.len() - 1;
        let Some(after) = newest.checked_sub(steps) else {
            return self.past[0];
        };
        let into = (age.as_nanos() % period.as_nanos()) as f64 / period.as_nanos() as f64;
        let [end, end_rate] = self.past[after];
        if into == 0.0 || after == 0 {
            return [end, end_rate];
        }
        let [start, start_rate] = self.past[after - 1];
        let (share, h) = (1.0 - into, period.as_secs_f64());
        let rise = end - start;
        let (from, to) = (h * start_rate - rise, rise - h * end_rate);
        let bend = share * into * (from * into + to * share);
        let slope = (into - share) * (from * into + to * share) + share * into * (to - from);
        [start + share * rise + bend, (rise + slope) / h]
    }

    /// Returns the instant of the position that is read now.
    fn read_at(&self) -> SimTime {
        earlier(self.now, self.reading_delay)
    }

    /// Returns the position that is read now \[rad\].
    fn position(&self) -> f64 {
        let period = self.firmware.period();
        let before_tick = self.tick - self.read_at().min(self.tick);
        let steps = before_tick.as_nanos().div_ceil(period.as_nanos());
        let tick = earlier(
            self.tick,
            SimDuration::from_nanos(steps * period.as_nanos()),
        );
        (self.motion_at(tick)[0] * self.counts_per_radian).round() / self.counts_per_radian
    }
}

/// Returns the instant that is `by` before another, not before the start.
fn earlier(time: SimTime, by: SimDuration) -> SimTime {
    SimTime::from_nanos(time.as_nanos().saturating_sub(by.as_nanos()))
}

/// Inputs, then the requested outputs, as ports and as signals.
fn signals(requested: &dyn Fn(&str) -> bool) -> (Vec<Port>, Vec<Signal>) {
    let inputs = INPUTS.iter();
    let mut ports: Vec<Port> = inputs
        .map(|(name, unit)| Port::input(*name, *unit, 1))
        .collect();
    let mut signals = Vec::new();
    let energies = signal::ENERGY.iter().enumerate();
    let energies = energies.map(|(index, standard)| (standard.output(), Signal::Energy(index)));
    let outputs = OUTPUTS
        .iter()
        .map(|(name, unit, signal)| (Port::output(*name, *unit, 1), *signal));
    for (port, signal) in outputs.chain(energies) {
        if requested(&port.name) {
            ports.push(port);
            signals.push(signal);
        }
    }
    (ports, signals)
}

impl Plant for ServoBench {
    fn name(&self) -> &'static str {
        "servo"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        inputs.copy_from_slice(&self.inputs);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        if let Some(index) = inputs.iter().position(|input| !input.is_finite()) {
            return Err(self.fault(INPUTS[index].0, "the input is not a number"));
        }
        if inputs != self.inputs {
            self.inputs = [inputs[0], inputs[1]];
            let command = ServoCommand {
                position: inputs[0],
                enabled: inputs[1] != 0.0,
            };
            self.firmware.command(self.now, self.tick, command);
        }
        let mut steps = LongLoop::default();
        while self.tick < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            self.period();
        }
        self.now = to;
        let [kinetic, potential] = self.model.stored(&self.state);
        self.ledger.close_step([kinetic, 0.0, potential]);
        if !(self.state.angle.is_finite() && self.state.rate.is_finite()) {
            return Err(self.fault("servo", "the motion has no bounds"));
        }
        let checked = self.ledger.check();
        checked.map_err(|why| self.fault("integrator", &why.to_string()))
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let [angle, rate] = self.motion_at(self.now);
        let motor_rate = self.state.loose.unwrap_or(rate);
        let electric = || {
            let rise = self.state.rise;
            self.model.winding.electric(self.bridge, motor_rate, rise)
        };
        for (output, signal) in outputs.iter_mut().zip(&self.signals) {
            *output = match *signal {
                Signal::Angle => angle,
                Signal::Rate => rate,
                Signal::Reading => self.motion_at(self.read_at())[0],
                Signal::Position => self.position(),
                Signal::Duty => match self.bridge {
                    Bridge::Open => 0.0,
                    Bridge::Duty(duty) => duty,
                },
                Signal::Supply => electric().voltage,
                Signal::Current => electric().current,
                Signal::Torque => electric().torque,
                Signal::Energy(index) => self.ledger.balance().values()[index],
            };
        }
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn work(&self) -> WorkCounts {
        self.work
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            tick: self.tick,
            state: self.state,
            bridge: self.bridge,
            inputs: self.inputs,
            past: self.past.clone(),
            firmware: self.firmware.state.clone(),
            ledger: self.ledger,
            work: self.work,
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        if saved.past.is_empty() || saved.past.len() > self.kept {
            return Err(SnapshotError::Mismatch {
                expected: format!("1 to {} past states", self.kept),
                found: format!("{} past states", saved.past.len()),
            });
        }
        (self.now, self.tick) = (saved.now, saved.tick);
        (self.state, self.bridge, self.inputs) = (saved.state, saved.bridge, saved.inputs);
        self.past.clear();
        self.past.extend(saved.past);
        self.firmware.state = saved.firmware;
        (self.ledger, self.work) = (saved.ledger, saved.work);
        Ok(())
    }

    /// Angle and rate, and the temperature of the winding and the motion within the backlash at the
    /// end of the present period.
    fn state(&self) -> Option<PlantState> {
        let [angle, rate] = self.motion_at(self.now);
        let state = PlantState::at(self.now).with(ANGLE, &[angle]);
        let state = state.with(RATE, &[rate]).with(RISE, &[self.state.rise]);
        // A state without these begins with teeth that carry the arm, wherever that is.
        if self.model.half_gap == 0.0 || self.model.is_carried(&self.state) {
            return Some(state);
        }
        let motor_rate = self.state.loose.unwrap_or(rate);
        let state = state.with(LEAD, &[self.state.lead]);
        Some(state.with(MOTOR_RATE, &[motor_rate]))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let value = |name: &str| match from.get(name) {
            Some(&[value]) if value.is_finite() => Some(value),
            _ => None,
        };
        let (Some(angle), Some(rate)) = (value(ANGLE), value(RATE)) else {
            return Err(self.fault("servo", "the state has no finite angle and rate of it"));
        };
        self.state = State {
            angle,
            rate,
            rise: value(RISE).unwrap_or_default(),
            ..State::default()
        };
        let gap = value(LEAD).zip(value(MOTOR_RATE));
        self.model.mesh(&mut self.state, gap);
        self.inputs = [angle, 1.0];
        self.firmware.restart(angle);
        (self.now, self.tick, self.bridge) = (from.time, from.time, Bridge::Open);
        self.restart();
        let mut known = vec![ANGLE, RATE, RISE];
        if self.model.half_gap > 0.0 {
            known.extend([LEAD, MOTOR_RATE]);
        }
        let unknown = from.iter().filter(|(name, _)| !known.contains(name));
        let lines = unknown.map(|(name, _)| format!("{name} is not a state of this plant"));
        Ok(lines.collect())
    }
}
