use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalTime, Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{Part, PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{Addresses, Diagnostics, Node, Piece, earlier};

use crate::config::{JointSignals, ServoConfig};
use crate::firmware::{BridgeCommand, ServoFirmware, ServoMeasurements};
use crate::responder::Responder;

/// Time from the return of the supply until a servo works. ASSUMED: the manuals have no figure.
const BOOT_TIME: SimDuration = SimDuration::from_millis(500);

/// Emulated servo on a bus: its registers, the inner loops of its firmware at its own clock, and
/// the motor in the plant.
///
/// At each period it samples the angle of its shaft \[rad\], the rate \[rad/s\] and, where the
/// plant has them, the current of the motor \[A\] and the voltage of the supply \[V\]; it writes
/// the duty cycle of the bridge and whether it is closed.
///
/// Diagnostics, `BUS/SERVO/…`, counted from the first power-on: `instructions`, `answers`,
/// `refused`, `damaged`, `framing_errors` ([`crate::ResponderCounters`]), `unheard`, bytes outside
/// packets.
pub struct ServoNode {
    config: ServoConfig,
    /// Prefix of the diagnostics.
    prefix: String,
    responder: Responder,
    firmware: Box<dyn ServoFirmware>,
    signals: Signals,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    next_tick: LocalTime,
    /// `next_tick` in physical time.
    wake: SimTime,
    /// Command of the bridge as last written to the plant.
    bridge: Option<BridgeCommand>,
}

/// Places of the signals in the plant.
#[derive(Clone, Debug, Default)]
struct Signals {
    angle: Range<usize>,
    rate: Range<usize>,
    current: Option<Range<usize>>,
    supply: Option<Range<usize>>,
    duty: Range<usize>,
    bridge: Range<usize>,
}

impl State {
    /// The state at power-on: the first tick ends the first complete period of the firmware.
    fn at_power_on(config: &ServoConfig, firmware: &dyn ServoFirmware, now: SimTime) -> Self {
        let clock = &config.clock;
        let shown = clock.local_at(now).as_nanos();
        let period = firmware.period().as_nanos();
        let next_tick = LocalTime::from_nanos((shown.div_euclid(period) + 1) * period);
        Self {
            next_tick,
            wake: clock.sim_at(next_tick),
            bridge: None,
        }
    }
}

impl ServoNode {
    /// Creates a servo at power-on, on the bus of that name, where a byte takes `byte_time`.
    pub fn new(bus: &str, config: &ServoConfig, byte_time: SimDuration) -> Self {
        let mut responder = Responder::new(config.model(), config.id, byte_time);
        for &(address, value) in &config.registers {
            responder.registers_mut().set(address, value);
        }
        let firmware = (config.kind.firmware)();
        let state = State::at_power_on(config, firmware.as_ref(), SimTime::ZERO);
        Self {
            prefix: format!("{bus}/{}", config.name),
            responder,
            firmware,
            signals: Signals::default(),
            state,
            config: config.clone(),
        }
    }

    /// Returns the side of the bus.
    pub fn responder(&self) -> &Responder {
        &self.responder
    }

    fn tick(&mut self, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.state.next_tick = self.state.next_tick + self.firmware.period();
        self.state.wake = self.config.clock.sim_at(self.state.next_tick);
        let measured = self.measure(plant)?;
        if self.responder.take_restart() {
            self.firmware = (self.config.kind.firmware)();
        }
        if self.responder.take_cleared_turns() {
            self.firmware.clear_turns();
        }
        let instructions = self.responder.counters().instructions;
        let registers = self.responder.registers_mut();
        let bridge = self.firmware.step(registers, &measured, instructions);
        self.drive(bridge, plant)
    }

    /// Commands the bridge, if the command is another one.
    fn drive(
        &mut self,
        bridge: BridgeCommand,
        plant: &mut dyn PlantAccess,
    ) -> Result<(), TaskError> {
        if self.state.bridge != Some(bridge) {
            let (closed, duty) = match bridge {
                BridgeCommand::Open => (0.0, 0.0),
                BridgeCommand::Duty(duty) => (1.0, duty),
            };
            plant.actuate(self.signals.duty.clone())?.fill(duty);
            plant.actuate(self.signals.bridge.clone())?.fill(closed);
            self.state.bridge = Some(bridge);
        }
        Ok(())
    }

    fn measure(&self, plant: &mut dyn PlantAccess) -> Result<ServoMeasurements, TaskError> {
        let Signals {
            angle,
            rate,
            current,
            supply,
            ..
        } = &self.signals;
        let mut sample = |range: &Range<usize>| -> Result<f64, TaskError> {
            Ok(plant
                .sample(range.clone())?
                .first()
                .copied()
                .unwrap_or_default())
        };
        Ok(ServoMeasurements {
            angle: sample(angle)?,
            rate: sample(rate)?,
            current: current.as_ref().map_or(Ok(0.0), &mut sample)?,
            voltage: supply
                .as_ref()
                .map_or(Ok(self.config.voltage), &mut sample)?,
            temperature: self.config.temperature,
        })
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        let counters = self.responder.counters();
        diagnostics.count("instructions", counters.instructions);
        diagnostics.count("answers", counters.answers);
        diagnostics.count("refused", counters.refused);
        diagnostics.count("damaged", counters.damaged);
        diagnostics.count("framing_errors", counters.framing_errors);
        diagnostics.count("unheard", self.responder.skipped());
    }
}

impl Part for ServoNode {
    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let JointSignals {
            angle,
            rate,
            current,
            supply,
            duty,
            bridge,
        } = &self.config.signals;
        let find = |port: Port| plant.find(owner, &port);
        let optional = |name: &String, unit: Unit| {
            let known = plant.outputs.field(name).is_some();
            known.then(|| find(Port::input(name, unit, 1))).transpose()
        };
        self.signals = Signals {
            angle: find(Port::input(angle, Unit::Radian, 1))?,
            rate: find(Port::input(rate, Unit::RadianPerSecond, 1))?,
            current: optional(current, Unit::Ampere)?,
            supply: optional(supply, Unit::Volt)?,
            duty: find(Port::output(duty, Unit::One, 1))?,
            bridge: find(Port::output(bridge, Unit::One, 1))?,
        };
        Ok(())
    }

    fn diagnostics(&self) -> Vec<Port> {
        Diagnostics::ports(&self.prefix, |diagnostics| self.report(diagnostics))
    }

    fn read_diagnostics(&self, _now: SimTime, values: &mut [f64]) {
        Diagnostics::read(values, |diagnostics| self.report(diagnostics));
    }

    fn save(&self) -> Snapshot {
        let name = &self.config.name;
        let firmware = self.firmware.save();
        Snapshot::of(&(name, self.responder.save(), firmware, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (name, responder, firmware, state): (String, Snapshot, Snapshot, State) =
            snapshot.read()?;
        if name != self.config.name {
            return Err(SnapshotError::Mismatch {
                expected: self.config.name.clone(),
                found: name,
            });
        }
        self.responder.restore(&responder)?;
        self.firmware.restore(&firmware)?;
        self.state = state;
        Ok(())
    }
}

impl Node for ServoNode {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn receive(&mut self, piece: Piece<'_>) {
        self.responder.receive(piece);
    }

    fn min_bytes_needed(&self) -> Option<usize> {
        Some(self.responder.missing())
    }

    fn listens_to(&self, spacing: SimDuration) -> Option<Addresses> {
        self.responder.listens_to(spacing)
    }

    fn boot_time(&self) -> Option<SimDuration> {
        Some(BOOT_TIME)
    }

    fn power_off(&mut self, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        self.drive(BridgeCommand::Open, plant)
    }

    fn power_on(&mut self, now: SimTime) {
        self.responder.power_cycle();
        self.firmware = (self.config.kind.firmware)();
        self.state = State::at_power_on(&self.config, self.firmware.as_ref(), now);
    }

    fn next_wake(&self) -> Option<SimTime> {
        earlier(Some(self.state.wake), self.responder.next_wake())
    }

    fn advance(&mut self, now: SimTime, plant: &mut dyn PlantAccess) -> Result<(), TaskError> {
        while self.state.wake <= now {
            self.tick(plant)?;
        }
        self.responder.handle(now);
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        self.responder.poll_transmit(bytes)
    }
}
