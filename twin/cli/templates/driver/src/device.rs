//! Device side of the wire: the emulated device. It receives requests and samples a signal of the
//! plant.

use serde::{Deserialize, Serialize};
use twinrig::bus::{
    AnalogInput, AnalogInputs, AnalogSource, Emulation, PlantAccess, PlantSignals, SimDuration,
    SimTime, TaskError, TxQueue, WiringError, quantize,
};

use crate::protocol::{Answer, MILLIMETRES_MAX, Request};

/// Duration of a measurement.
const MEASUREMENT_TIME: SimDuration = SimDuration::from_millis(5);

/// Configuration, and the measured signal of the plant.
pub struct EmulatedDevice {
    name: String,
    /// One input: the distance \[m\].
    inputs: AnalogInputs,
}

/// Changing state.
#[derive(Default, Serialize, Deserialize)]
pub struct State {
    /// End of the current measurement.
    measured_at: Option<SimTime>,
}

impl EmulatedDevice {
    pub fn new(name: &str, distance: AnalogSource) -> Self {
        let input = AnalogInput {
            channel: 0,
            analog_source: Some(distance),
        };
        Self {
            name: name.to_owned(),
            inputs: AnalogInputs::new(vec![input]),
        }
    }
}

impl Emulation for EmulatedDevice {
    type State = State;
    type Message = Request;

    fn initial(&self) -> State {
        State::default()
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        self.inputs.connect(owner, plant)
    }

    fn handle_message(
        &self,
        state: &mut State,
        now: SimTime,
        _request: Request,
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
        let millimetres = 1e3 * self.inputs.read(0, plant)?;
        let (millimetres, _) = quantize(millimetres, 0..=MILLIMETRES_MAX);
        tx.send(now, &Answer(millimetres));
        Ok(())
    }
}
