use std::f64::consts::TAU;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, Unit};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{Diagnostics, Emulation, FrameError, FramedNode, TxQueue, quantize};

use super::OptoForce;
use super::assumed::{NOMINAL_COUNTS, REACTION, SAMPLE_PERIOD};
use super::protocol::{Counts, Cutoff, Message, Speed, Status};

/// Emulated sensor: measures and filters every millisecond of its own clock, and sends at the
/// configured rate.
pub type OptoForceSensor = FramedNode<OptoForceEmulation>;

/// Device-specific part of the emulated sensor.
#[derive(Debug)]
pub struct OptoForceEmulation {
    config: OptoForce,
    /// Place of the force in the plant.
    force: Range<usize>,
}

/// Changing state.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct State {
    speed: Speed,
    cutoff: Cutoff,
    /// Number of measurements.
    measured: u64,
    /// State of the filter \[N\]; `None` before the first measurement.
    filtered: Option<[f64; 3]>,
    /// Offset \[N\].
    zero: [f64; 3],
    sent: u64,
}

/// Status for a configuration that is not understood. ASSUMED: only 0, for done, is documented.
const REJECTED: u8 = 1;

impl OptoForceEmulation {
    /// Creates the emulation from a checked configuration.
    pub(super) fn new(config: OptoForce) -> Self {
        Self {
            config,
            force: 0..0,
        }
    }

    /// Returns the next sample, of a force \[N\].
    fn data(&self, state: &State, force: [f64; 3]) -> Message {
        let readings: [_; 3] = std::array::from_fn(|axis| {
            let exact = (force[axis] - state.zero[axis]) * self.config.sensitivity;
            quantize(exact, -NOMINAL_COUNTS..=NOMINAL_COUNTS)
        });
        let [.., high, low] = (state.sent + 1).to_be_bytes();
        Message::Data {
            counter: u16::from_be_bytes([high, low]),
            status: Status::default().with_overload(readings.map(|(_, saturated)| saturated)),
            counts: Counts::Three(readings.map(|(count, _)| count)),
        }
    }
}

impl State {
    /// Advances the filter by one measurement: first order, exact for a force that is constant
    /// between two measurements.
    fn filter(&mut self, force: [f64; 3]) -> [f64; 3] {
        let seconds = SAMPLE_PERIOD.as_secs_f64();
        let cutoff = self.cutoff.hertz();
        let gain = cutoff.map_or(1.0, |hertz| -libm::expm1(-TAU * hertz * seconds));
        let filtered = self.filtered.get_or_insert(force);
        for (filtered, force) in filtered.iter_mut().zip(force) {
            *filtered += gain * (force - *filtered);
        }
        *filtered
    }
}

impl Emulation for OptoForceEmulation {
    type State = State;
    type Message = Message;

    /// Factory settings: 100 Hz, cut-off at 15 Hz, no offset.
    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let force = Port::input(&self.config.signal, Unit::Newton, 3);
        self.force = plant.find(owner, &force)?;
        Ok(())
    }

    fn next_instant(&self, state: &State) -> Option<SimTime> {
        let clock = &self.config.clock;
        Some(clock.sim_at_period(SAMPLE_PERIOD, state.measured, SimDuration::ZERO))
    }

    fn act(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        let force = plant.sample(self.force.clone())?;
        let filtered = state.filter([force[0], force[1], force[2]]);
        let every = u64::from(state.speed.code());
        if every > 0 && state.measured.is_multiple_of(every) {
            tx.send(now, &self.data(state, filtered));
            state.sent += 1;
        }
        state.measured += 1;
        Ok(())
    }

    fn handle_message(
        &self,
        state: &mut State,
        now: SimTime,
        message: Message,
        _plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        // Messages of the other direction are ignored.
        if let Message::Configuration {
            speed,
            cutoff,
            zero,
        } = message
        {
            state.speed = speed;
            state.cutoff = cutoff;
            let filtered = state.filtered.unwrap_or_default();
            state.zero = if zero { filtered } else { [0.0; 3] };
            tx.send(now + REACTION, &Message::Acknowledgement { status: 0 });
        }
        Ok(())
    }

    fn handle_invalid(&self, now: SimTime, _error: FrameError, tx: &mut TxQueue) {
        tx.send(
            now + REACTION,
            &Message::Acknowledgement { status: REJECTED },
        );
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("sent", state.sent);
    }
}
