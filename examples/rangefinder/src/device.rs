//! Right of the wire: what stands in for the device. It hears requests, and sees a signal of the plant.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{SimDuration, SimTime};
use twinrig::runtime::{PlantSignals, TaskError, WiringError, World};
use twinrig_wire::{Emulation, Measure, Said, Tap};

use crate::protocol::{ASK, MILLIMETRES_MAX, encode};

/// How long a measurement takes.
const MEASURING: SimDuration = SimDuration::from_millis(5);

/// What is configured, and where the plant has what it measures.
pub struct EmulatedRangeFinder {
    name: String,
    /// What it measures \[m\].
    tap: Tap,
    place: usize,
}

/// What changes.
#[derive(Default, Serialize, Deserialize)]
pub struct State {
    /// When the measurement that was asked for is over.
    measured_at: Option<SimTime>,
}

impl EmulatedRangeFinder {
    pub fn new(name: &str, tap: Tap) -> Self {
        Self {
            name: name.to_owned(),
            tap,
            place: 0,
        }
    }
}

impl Emulation for EmulatedRangeFinder {
    type State = State;

    /// A request is one byte.
    fn measure(front: &[u8]) -> Measure {
        match front {
            [] => Measure::Missing(1),
            [ASK, ..] => Measure::Frame(1),
            _ => Measure::Garbage,
        }
    }

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.place = self.tap.find(owner, plant)?;
        Ok(())
    }

    fn hear(
        &self,
        state: &mut State,
        now: SimTime,
        _frame: &[u8],
        _world: &mut dyn World,
        _said: &mut Said,
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
        world: &mut dyn World,
        said: &mut Said,
    ) -> Result<(), TaskError> {
        state.measured_at = None;
        let seen = world.sample(self.place..self.place + 1)?[0];
        let millimetres = (1e3 * self.tap.reading(seen)).round();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped; what is no number becomes 0"
        )]
        let millimetres = millimetres.clamp(0.0, f64::from(MILLIMETRES_MAX)) as u32;
        said.say(now, |bytes| encode(millimetres, bytes));
        Ok(())
    }
}
