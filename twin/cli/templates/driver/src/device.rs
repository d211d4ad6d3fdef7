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
pub struct EmulatedRangeFinder {
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

impl EmulatedRangeFinder {
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

impl Emulation for EmulatedRangeFinder {
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use twinrig::bus::{FramedMessage, FramedNode, Part, Port, Unit};
    use twinrig::testing::driver_harness::{StaticPlant, plant, run_device};

    use super::*;

    proptest! {
        /// The answer begins when the measurement ends, whenever the request arrives.
        #[test]
        fn answer_takes_the_time_of_a_measurement(millimetres in 0..1000_u32, us in 0..90_000_u64) {
            let source = AnalogSource {
                signal: "height".to_owned(),
                component: 0,
                scale: 1.0,
                offset: 0.0,
            };
            let mut device = FramedNode::new(EmulatedRangeFinder::new("device", source));
            let ports = [Port::output("height", Unit::Meter, 1)];
            device.connect("device", &plant(&ports)).unwrap();
            let mut height = StaticPlant {
                outputs: vec![f64::from(millimetres) * 1e-3],
                ..StaticPlant::default()
            };
            let at = |us| SimTime::ZERO + SimDuration::from_micros(us);
            let sent = run_device(&mut device, &mut height, (at(us), b"R"), at(100_000));
            let mut answer = Vec::new();
            Answer(millimetres).encode(&mut answer);
            prop_assert_eq!(sent, [(at(us) + MEASUREMENT_TIME, answer)]);
        }
    }
}
