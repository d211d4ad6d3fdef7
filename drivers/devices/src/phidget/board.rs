use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{AnalogInputs, Diagnostics, Emulation, FramedNode, TxQueue, quantize};

use super::assumed::POLL;
use super::protocol::{ANALOG, BRIDGES, COUNTS, Gain, Message, SCALE, Setup};
use super::{Board, Phidget};

/// Emulated board: polled by USB every 8 ms of its own clock; it reports once it has been set up.
pub type PhidgetBoard = FramedNode<PhidgetEmulation>;

/// Device-specific part of an emulated board.
#[derive(Debug)]
pub struct PhidgetEmulation {
    config: Phidget,
    inputs: AnalogInputs,
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
    pub(super) fn new(config: Phidget) -> Self {
        Self {
            inputs: AnalogInputs::new(config.inputs.clone()),
            config,
        }
    }

    fn next_poll(&self, state: &State) -> SimTime {
        let clock = &self.config.clock;
        clock.sim_at_period(POLL, state.polls, SimDuration::ZERO)
    }

    /// Returns the present values at the inputs.
    fn read<const N: usize>(&self, plant: &mut dyn PlantAccess) -> Result<[f64; N], TaskError> {
        let mut values = [0.0; N];
        for (channel, value) in values.iter_mut().enumerate() {
            *value = self.inputs.read(channel, plant)?;
        }
        Ok(values)
    }

    /// Returns the report at a poll, if one is due.
    fn poll(
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
    let readings = ratios.map(|ratio| {
        let exact = ratio * f64::from(gain.times()) * f64::from(COUNTS);
        quantize(exact, -COUNTS..=COUNTS - 1)
    });
    Message::Bridge {
        sequence,
        overload: readings.map(|(_, saturated)| saturated),
        counts: readings.map(|(count, _)| count),
    }
}

/// Returns the reading of an interface kit for a voltage: 10 bits, in thousandths of 5 V.
fn reading(volts: f64) -> u16 {
    const STEPS: u32 = 1 << 10;
    // The converter rounds down.
    let exact = (volts / 5.0 * f64::from(STEPS)).floor();
    let (step, _) = quantize(exact, 0..=STEPS - 1);
    let rounded = (step * u32::from(SCALE) + (STEPS - 1) / 2) / (STEPS - 1);
    u16::try_from(rounded).unwrap_or(SCALE)
}

impl Emulation for PhidgetEmulation {
    type State = State;
    type Message = Message;

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.config.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.inputs.connect(owner, plant)
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
        if let Some(message) = self.poll(state, plant)? {
            state.sent += 1;
            state.reported_at = Some(state.polls);
            tx.send(now, &message);
        }
        state.polls += 1;
        Ok(())
    }

    /// The answer to a set-up is transmitted at the next poll.
    fn handle_message(
        &self,
        state: &mut State,
        _now: SimTime,
        message: Message,
        _plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        let Message::Setup(setup) = message else {
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
        tx.send(self.next_poll(state), &Message::Accepted { done });
        Ok(())
    }

    fn report(&self, state: &State, diagnostics: &mut Diagnostics<'_>) {
        diagnostics.count("sent", state.sent);
    }
}
