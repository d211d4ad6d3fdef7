use serde::{Deserialize, Serialize};
use twinrig_kernel::{LocalTime, SimTime, Unit};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{Emulation, FrameMatch, FramedNode, TxQueue};

use crate::assumed::POLL;
use crate::protocol::{ANALOG, BRIDGES, COUNTS, Frame, Gain, Message, SCALE, Setup, match_frame};
use crate::{Board, Phidget};

/// Emulated board: polled by USB every 8 ms of its own clock; it reports once it has been set up.
pub type PhidgetBoard = FramedNode<PhidgetEmulation>;

/// Device-specific part of an emulated board.
#[derive(Debug)]
pub struct PhidgetEmulation {
    config: Phidget,
    /// Places of the inputs' signals in the plant.
    inputs: Vec<usize>,
}

/// Changing state.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct State {
    setup: Option<Setup>,
    /// Number of polls.
    polls: u64,
    /// Number of polls at the last report.
    reported_at: Option<u64>,
    /// Readings of the last report of an interface kit.
    readings: [u16; ANALOG],
    sent: u64,
}

impl PhidgetEmulation {
    /// Creates the emulation from a checked configuration.
    pub(crate) fn new(config: Phidget) -> Self {
        Self {
            config,
            inputs: Vec::new(),
        }
    }

    fn next_poll(&self, state: &State) -> SimTime {
        let shown = POLL.as_nanos().saturating_mul(state.polls);
        let shown = i64::try_from(shown).unwrap_or(i64::MAX);
        self.config.clock.sim_at(LocalTime::from_nanos(shown))
    }

    /// Returns the present values at the inputs.
    fn read<const N: usize>(&self, plant: &mut dyn PlantAccess) -> Result<[f64; N], TaskError> {
        let mut values = [0.0; N];
        for (input, &place) in self.config.inputs.iter().zip(&self.inputs) {
            if let Some(value) = values.get_mut(input.channel) {
                *value = input
                    .analog_source
                    .reading(plant.sample(place..place + 1)?[0]);
            }
        }
        Ok(values)
    }

    /// Returns the report at a poll, if one is due.
    fn report(
        &self,
        state: &mut State,
        plant: &mut dyn PlantAccess,
    ) -> Result<Option<Message>, TaskError> {
        let [.., sequence] = (state.sent + 1).to_be_bytes();
        Ok(match state.setup {
            Some(Setup::Bridge { interval_ms, gain }) => {
                let polls = u64::from(interval_ms) * 1_000_000 / POLL.as_nanos();
                let due = |last| state.polls >= last + polls;
                if state.reported_at.is_none_or(due) {
                    Some(bridge(sequence, gain, self.read(plant)?))
                } else {
                    None
                }
            }
            Some(Setup::InterfaceKit { trigger }) => {
                let readings: [u16; ANALOG] = self.read(plant)?.map(reading);
                let last = state.readings;
                let changed = |n: usize| readings[n].abs_diff(last[n]) >= trigger;
                let first = state.reported_at.is_none();
                // An input with a smaller change is reported unchanged.
                state.readings = std::array::from_fn(|n| {
                    if first || changed(n) {
                        readings[n]
                    } else {
                        last[n]
                    }
                });
                let readings = state.readings;
                (first || (0..ANALOG).any(changed))
                    .then_some(Message::InterfaceKit { sequence, readings })
            }
            None => None,
        })
    }
}

/// Returns the report of a bridge with those ratios.
fn bridge(sequence: u8, gain: Gain, ratios: [f64; BRIDGES]) -> Message {
    let mut overload = [false; BRIDGES];
    let counts = std::array::from_fn(|n| {
        let exact = (ratios[n] * f64::from(gain.times()) * f64::from(COUNTS)).round();
        let count = exact.clamp(-f64::from(COUNTS), f64::from(COUNTS - 1));
        overload[n] = count != exact;
        // NaN becomes 0, marked as an overload.
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

/// Returns the reading of an interface kit for a voltage: 10 bits, in thousandths of 5 V.
fn reading(volts: f64) -> u16 {
    const STEPS: u32 = 1 << 10;
    let step = (volts / 5.0 * f64::from(STEPS)).clamp(0.0, f64::from(STEPS - 1));
    // NaN becomes 0.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 1023; the converter rounds down"
    )]
    let step = step as u32;
    let rounded = (step * u32::from(SCALE) + (STEPS - 1) / 2) / (STEPS - 1);
    u16::try_from(rounded).unwrap_or(SCALE)
}

impl Emulation for PhidgetEmulation {
    type State = State;

    const DIAGNOSTICS: &'static [(&'static str, Unit)] = &[("sent", Unit::One)];

    fn match_frame(front: &[u8]) -> FrameMatch {
        match_frame(front)
    }

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let inputs = self.config.inputs.iter();
        self.inputs = inputs
            .map(|input| input.analog_source.find(owner, plant))
            .collect::<Result<_, _>>()?;
        Ok(())
    }

    fn next_instant(&self, state: &State) -> Option<SimTime> {
        Some(self.next_poll(state))
    }

    fn act(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        if let Some(message) = self.report(state, plant)? {
            state.sent += 1;
            state.reported_at = Some(state.polls);
            tx.say(now, |bytes| message.encode(bytes));
        }
        state.polls += 1;
        Ok(())
    }

    /// The answer to a set-up is transmitted at the next poll.
    fn handle_frame(
        &self,
        state: &mut State,
        _now: SimTime,
        frame: &[u8],
        _plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        let Ok(Message::Setup(setup)) = Frame::new(frame).and_then(Message::try_from) else {
            return Ok(());
        };
        let done = matches!(
            (setup, self.config.board),
            (Setup::Bridge { .. }, Board::Bridge { .. })
                | (Setup::InterfaceKit { .. }, Board::InterfaceKit { .. })
        );
        if done {
            state.setup = Some(setup);
            state.reported_at = None;
        }
        let message = Message::Accepted { done };
        tx.say(self.next_poll(state), |bytes| message.encode(bytes));
        Ok(())
    }

    fn read_diagnostics(&self, state: &State, values: &mut [f64]) {
        values.copy_from_slice(&[state.sent as f64]);
    }
}
