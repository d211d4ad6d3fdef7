use twinrig_runtime::{PlantAccess, PlantSignals, TaskError, WiringError};

use crate::AnalogSource;

/// Analog input of a board.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogInput {
    /// Number of the input, from 0.
    pub channel: usize,
    /// Measured quantity, in the unit of the input; an input without a source reads 0. Not used by
    /// a driver.
    pub analog_source: Option<AnalogSource>,
}

/// Analog inputs of an emulated board, with the places of their signals in the plant.
#[derive(Clone, Debug)]
pub struct AnalogInputs {
    inputs: Vec<AnalogInput>,
    places: Vec<Option<usize>>,
}

impl AnalogInputs {
    /// Creates inputs that are not connected yet.
    pub const fn new(inputs: Vec<AnalogInput>) -> Self {
        Self {
            inputs,
            places: Vec::new(),
        }
    }

    /// Resolves the signals.
    ///
    /// # Errors
    /// [`WiringError`] if the plant lacks one.
    pub fn connect(&mut self, owner: &str, plant: &PlantSignals) -> Result<(), WiringError> {
        let sources = self.inputs.iter().map(|input| &input.analog_source);
        let places = sources.map(|source| source.as_ref().map(|source| source.find(owner, plant)));
        self.places = places.map(Option::transpose).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// Returns the present reading of the input `channel`.
    ///
    /// # Errors
    /// [`TaskError`] if the plant fails.
    pub fn read(&self, channel: usize, plant: &mut dyn PlantAccess) -> Result<f64, TaskError> {
        for (input, place) in self.inputs.iter().zip(&self.places) {
            if let (true, Some(source), Some(place)) =
                (input.channel == channel, &input.analog_source, *place)
            {
                return Ok(source.reading(plant.sample(place..place + 1)?[0]));
            }
        }
        Ok(0.0)
    }
}
