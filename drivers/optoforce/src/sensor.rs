use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalTime, Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};
use twinrig_wire::{Framer, FramerState, Node, Piece};

use crate::OptoForce;
use crate::assumed::{MEASURES_EVERY, NOMINAL_COUNTS, REACTION};
use crate::protocol::{Counts, Cutoff, Frame, Message, Speed, Status, measure};

/// The emulated sensor: measures every millisecond of its own clock, filters, and sends as often as it was told to.
#[derive(Debug)]
pub struct OptoForceSensor {
    config: OptoForce,
    framer: Framer,
    /// Where the plant has the force.
    force: Range<usize>,
    state: State,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    speed: Speed,
    cutoff: Cutoff,
    /// How often it has measured.
    measured: u64,
    /// What the filter holds \[N\]; none before the first measurement.
    filtered: Option<[f64; 3]>,
    /// What counts as no force \[N\].
    zero: [f64; 3],
    sent: u64,
    said: VecDeque<(SimTime, Vec<u8>)>,
}

impl OptoForceSensor {
    /// As it is switched on: 100 Hz, 15 Hz, nothing zeroed.
    pub(crate) fn new(config: OptoForce) -> Self {
        Self {
            config,
            framer: Framer::new(measure),
            force: 0..0,
            state: State {
                speed: Speed::default(),
                cutoff: Cutoff::default(),
                measured: 0,
                filtered: None,
                zero: [0.0; 3],
                sent: 0,
                said: VecDeque::new(),
            },
        }
    }

    fn next_measurement(&self) -> SimTime {
        let shown = MEASURES_EVERY
            .as_nanos()
            .saturating_mul(self.state.measured);
        let shown = i64::try_from(shown).unwrap_or(i64::MAX);
        self.config.clock.sim_at(LocalTime::from_nanos(shown))
    }

    fn measure(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        let force = world.sample(self.force.clone())?;
        let seconds = MEASURES_EVERY.as_secs_f64();
        // First order, exact for a force that is held between two measurements.
        let share = self
            .state
            .cutoff
            .hertz()
            .map_or(1.0, |hertz| -libm::expm1(-TAU * hertz * seconds));
        let filtered = self
            .state
            .filtered
            .get_or_insert([force[0], force[1], force[2]]);
        for (filtered, force) in filtered.iter_mut().zip(force) {
            *filtered += share * (force - *filtered);
        }
        let filtered = *filtered;
        let every = u64::from(self.state.speed.code());
        if every > 0 && self.state.measured.is_multiple_of(every) {
            self.send(now, filtered);
        }
        self.state.measured += 1;
        Ok(())
    }

    fn send(&mut self, now: SimTime, force: [f64; 3]) {
        let mut overload = [false; 3];
        let counts = std::array::from_fn(|axis| {
            let newtons = force[axis] - self.state.zero[axis];
            let wanted = (newtons * self.config.sensitivity).round();
            let count = wanted.clamp(-NOMINAL_COUNTS, NOMINAL_COUNTS);
            overload[axis] = count != wanted;
            // What is no number becomes 0, and is marked as an overload.
            #[expect(clippy::cast_possible_truncation, reason = "within ± 6000")]
            let count = count as i16;
            count
        });
        self.state.sent += 1;
        let [.., high, low] = self.state.sent.to_be_bytes();
        let data = Message::Data {
            counter: u16::from_be_bytes([high, low]),
            status: Status::default().with_overload(overload),
            counts: Counts::Three(counts),
        };
        self.say(now, &data);
    }

    fn say(&mut self, start: SimTime, message: &Message) {
        let mut bytes = Vec::new();
        message.encode(&mut bytes);
        self.state.said.push_back((start, bytes));
    }

    fn configure(&mut self, now: SimTime, message: &Message) {
        if let Message::Configuration {
            speed,
            cutoff,
            zero,
        } = *message
        {
            self.state.speed = speed;
            self.state.cutoff = cutoff;
            let filtered = self.state.filtered.unwrap_or_default();
            self.state.zero = if zero { filtered } else { [0.0; 3] };
            self.say(now + REACTION, &Message::Acknowledgement { status: 0 });
        }
    }
}

/// What the sensor answers to what it does not understand. ASSUMED: only 0, for done, is documented.
const REFUSED: u8 = 1;

impl Node for OptoForceSensor {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let force = Port::input(&self.config.signal, Unit::Newton, 3);
        self.force = plant.find(owner, &force)?;
        Ok(())
    }

    fn hear(&mut self, piece: Piece<'_>) {
        self.framer.push(piece.bytes);
    }

    fn attention(&self) -> Option<usize> {
        Some(self.framer.missing())
    }

    fn next_wake(&self) -> Option<SimTime> {
        Some(self.next_measurement())
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        while self.next_measurement() <= now {
            self.measure(now, world)?;
        }
        while let Some(frame) = self.framer.next_frame() {
            match Frame::new(frame).and_then(Message::try_from) {
                Ok(message) => self.configure(now, &message),
                Err(_) => self.say(
                    now + REACTION,
                    &Message::Acknowledgement { status: REFUSED },
                ),
            }
        }
        Ok(())
    }

    fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> Option<SimTime> {
        let (start, said) = self.state.said.pop_front()?;
        bytes.extend(said);
        Some(start)
    }

    fn gauges(&self) -> Vec<Port> {
        let name = &self.config.name;
        ["sent", "unheard"]
            .map(|gauge| Port::output(format!("{name}/{gauge}"), Unit::One, 1))
            .into()
    }

    fn read_gauges(&self, _now: SimTime, values: &mut [f64]) {
        values.copy_from_slice(&[self.state.sent as f64, self.framer.skipped() as f64]);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.state, self.framer.state()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (state, framer): (State, FramerState) = snapshot.read()?;
        self.state = state;
        self.framer.set_state(framer);
        Ok(())
    }
}
