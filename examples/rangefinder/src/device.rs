//! Device side of the wire: the emulated device. It receives requests and samples a signal of the
//! plant.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{PlantAccess, PlantSignals, TaskError, WiringError};
use twinrig_wire::{AnalogSource, Emulation, FrameMatch, TxQueue};

use crate::protocol::{MILLIMETRES_MAX, REQUEST, encode};

/// Duration of a measurement.
const MEASUREMENT_TIME: SimDuration = SimDuration::from_millis(5);

/// Configuration, and place of the measured signal in the plant.
pub struct EmulatedRangeFinder {
    name: String,
    /// Measured quantity \[m\].
    analog_source: AnalogSource,
    place: usize,
}

/// Changing state.
#[derive(Default, Serialize, Deserialize)]
pub struct State {
    /// End of the current measurement.
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

    /// A request is a single byte.
    fn match_frame(front: &[u8]) -> FrameMatch {
        match front {
            [] => FrameMatch::Missing(1),
            [REQUEST, ..] => FrameMatch::Frame(1),
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

    fn handle_frame(
        &self,
        state: &mut State,
        now: SimTime,
        _frame: &[u8],
        _plant: &mut dyn PlantAccess,
        _tx: &mut TxQueue,
    ) -> Result<(), TaskError> {
        // A request during a measurement does not restart it.
        state.measured_at.get_or_insert(now + MEASUREMENT_TIME);
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
        let value = plant.sample(self.place..self.place + 1)?[0];
        let millimetres = (1e3 * self.analog_source.reading(value)).round();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped; NaN becomes 0"
        )]
        let millimetres = millimetres.clamp(0.0, f64::from(MILLIMETRES_MAX)) as u32;
        tx.say(now, |bytes| encode(millimetres, bytes));
        Ok(())
    }
}
