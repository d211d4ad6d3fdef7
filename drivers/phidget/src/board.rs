use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalTime, Port, SimTime, Snapshot, SnapshotError, Unit};
use twinrig_runtime::{PlantSignals, TaskError, WiringError, World};
use twinrig_wire::{Framer, FramerState, Node, Piece};

use crate::assumed::POLL;
use crate::protocol::{ANALOG, BRIDGES, COUNTS, Frame, Gain, Message, SCALE, Setup, measure};
use crate::{Board, Phidget};

/// The emulated board: USB asks it every 8 ms of its own clock; it reports once it has been set up.
#[derive(Debug)]
pub struct PhidgetBoard {
    config: Phidget,
    framer: Framer,
    /// Where the plant has what its inputs read.
    inputs: Vec<usize>,
    state: State,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct State {
    setup: Option<Setup>,
    /// How often USB has asked.
    polls: u64,
    /// How often by the last report.
    reported_at: Option<u64>,
    /// What an interface kit reported last.
    readings: [u16; ANALOG],
    sent: u64,
    said: VecDeque<(SimTime, Vec<u8>)>,
}

impl PhidgetBoard {
    /// From what was checked.
    pub(crate) fn new(config: Phidget) -> Self {
        Self {
            config,
            framer: Framer::new(measure),
            inputs: Vec::new(),
            state: State::default(),
        }
    }

    fn next_poll(&self) -> SimTime {
        let shown = POLL.as_nanos().saturating_mul(self.state.polls);
        let shown = i64::try_from(shown).unwrap_or(i64::MAX);
        self.config.clock.sim_at(LocalTime::from_nanos(shown))
    }

    /// What the inputs read now.
    fn read<const N: usize>(&self, world: &mut dyn World) -> Result<[f64; N], TaskError> {
        let mut values = [0.0; N];
        for (input, &place) in self.config.inputs.iter().zip(&self.inputs) {
            if let Some(value) = values.get_mut(input.channel) {
                *value = input.tap.reading(world.sample(place..place + 1)?[0]);
            }
        }
        Ok(values)
    }

    fn poll(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        let [.., sequence] = (self.state.sent + 1).to_be_bytes();
        let message = match self.state.setup {
            Some(Setup::Bridge { interval_ms, gain }) => {
                let polls = u64::from(interval_ms) * 1_000_000 / POLL.as_nanos();
                let due = |last| self.state.polls >= last + polls;
                let due = self.state.reported_at.is_none_or(due);
                due.then(|| {
                    self.read(world)
                        .map(|ratios| bridge(sequence, gain, ratios))
                })
                .transpose()?
            }
            Some(Setup::InterfaceKit { trigger }) => {
                let readings: [u16; ANALOG] = self.read(world)?.map(reading);
                let last = self.state.readings;
                let apart = |n: usize| readings[n].abs_diff(last[n]) >= trigger;
                let first = self.state.reported_at.is_none();
                // An input that has not changed by that much is reported as it was.
                self.state.readings = std::array::from_fn(|n| {
                    if first || apart(n) {
                        readings[n]
                    } else {
                        last[n]
                    }
                });
                let readings = self.state.readings;
                (first || (0..ANALOG).any(apart))
                    .then_some(Message::InterfaceKit { sequence, readings })
            }
            None => None,
        };
        if let Some(message) = message {
            self.state.sent += 1;
            self.state.reported_at = Some(self.state.polls);
            self.say(now, &message);
        }
        self.state.polls += 1;
        Ok(())
    }

    fn say(&mut self, start: SimTime, message: &Message) {
        let mut bytes = Vec::new();
        message.encode(&mut bytes);
        self.state.said.push_back((start, bytes));
    }

    /// What it says to that, it says when USB asks next.
    fn set_up(&mut self, setup: Setup) {
        let done = matches!(
            (setup, self.config.board),
            (Setup::Bridge { .. }, Board::Bridge { .. })
                | (Setup::InterfaceKit { .. }, Board::InterfaceKit { .. })
        );
        if done {
            self.state.setup = Some(setup);
            self.state.reported_at = None;
        }
        self.say(self.next_poll(), &Message::Accepted { done });
    }
}

/// The report of a bridge with those ratios.
fn bridge(sequence: u8, gain: Gain, ratios: [f64; BRIDGES]) -> Message {
    let mut overload = [false; BRIDGES];
    let counts = std::array::from_fn(|n| {
        let wanted = (ratios[n] * f64::from(gain.times()) * f64::from(COUNTS)).round();
        let count = wanted.clamp(-f64::from(COUNTS), f64::from(COUNTS - 1));
        overload[n] = count != wanted;
        // What is no number becomes 0, and is marked as an overload.
        #[expect(clippy::cast_possible_truncation, reason = "within 24 bits")]
        let count = count as i32;
        count
    });
    Message::Bridge {
        sequence,
        overload,
        counts,
    }
}

/// What an interface kit makes of a voltage: 10 bits, shown in thousandths.
fn reading(volts: f64) -> u16 {
    const STEPS: u32 = 1 << 10;
    let step = (volts / 5.0 * f64::from(STEPS)).clamp(0.0, f64::from(STEPS - 1));
    // What is no number becomes 0.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 1023; the converter rounds down"
    )]
    let step = step as u32;
    let rounded = (step * u32::from(SCALE) + (STEPS - 1) / 2) / (STEPS - 1);
    u16::try_from(rounded).unwrap_or(SCALE)
}

impl Node for PhidgetBoard {
    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let inputs = self.config.inputs.iter();
        self.inputs = inputs
            .map(|input| input.tap.find(owner, plant))
            .collect::<Result<_, _>>()?;
        Ok(())
    }

    fn hear(&mut self, piece: Piece<'_>) {
        self.framer.push(piece.bytes);
    }

    fn attention(&self) -> Option<usize> {
        Some(self.framer.missing())
    }

    fn next_wake(&self) -> Option<SimTime> {
        Some(self.next_poll())
    }

    fn advance(&mut self, now: SimTime, world: &mut dyn World) -> Result<(), TaskError> {
        while self.next_poll() <= now {
            self.poll(now, world)?;
        }
        while let Some(frame) = self.framer.next_frame() {
            if let Ok(Message::Setup(setup)) = Frame::new(frame).and_then(Message::try_from) {
                self.set_up(setup);
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
