//! Right of the wire: what stands in for the device. It hears requests, and sees a signal of the plant.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{AnalogSource, Emulation, FrameMatch, TxQueue};

use crate::protocol::{ASK, MILLIMETRES_MAX, encode};

/// How long a measurement takes.
const MEASURING: SimDuration = SimDuration::from_millis(5);

/// What is configured, and where the plant has what it measures.
pub struct EmulatedRangeFinder {
    name: String,
    /// What it measures \[m\].
    analog_source: AnalogSource,
    place: usize,
}

/// What changes.
#[derive(Default, Serialize, Deserialize)]
pub struct State {
    /// When the measurement that was asked for is over.
    measured_at: Option<SimTime>,
}

impl EmulatedRangeFinder {
    pub fn new(name: &str, analog_source: AnalogSource) -> Self {
        Self {
            name: name.to_owned(),
            analog_source,
            place: 0,
        }
    }
}

impl Emulation for EmulatedRangeFinder {
    type State = State;

    /// A request is one byte.
    fn match_frame(front: &[u8]) -> FrameMatch {
        match front {
            [] => FrameMatch::Missing(1),
            [ASK, ..] => FrameMatch::Frame(1),
            _ => FrameMatch::Garbage,
        }
    }

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.place = self.analog_source.find(owner, plant)?;
        Ok(())
    }

    fn receive(
        &self,
        state: &mut State,
        now: SimTime,
        _frame: &[u8],
        _world: &mut dyn PlantAccess,
        _said: &mut TxQueue,
    ) -> Result<(), TaskError> {
        // A measurement that is going on goes on.
        state.measured_at.get_or_insert(now + MEASURING);
        Ok(())
    }

    fn next_instant(&self, state: &State) -> Option<SimTime> {
        state.measured_at
    }

    fn act(
        &self,
        state: &mut State,
        now: SimTime,
        plant: &mut dyn PlantAccess,
        tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        state.measured_at = None;
        let seen = plant.sample(self.place..self.place + 1)?[0];
        let millimetres = (1e3 * self.analog_source.reading(seen)).round();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped; what is no number becomes 0"
        )]
        let millimetres = millimetres.clamp(0.0, f64::from(MILLIMETRES_MAX)) as u32;
        tx.say(now, |bytes| encode(millimetres, bytes));
        Ok(())
    }
}
