use twinrig_kernel::{Port, Unit};
use twinrig_runtime::{PlantSignals, WiringError};

/// Source of an analog input of a board: one component of a plant signal with a linear scaling,
/// reading = scale · value + offset, in the unit of the signal.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogSource {
    /// Name of the signal.
    pub signal: String,
    /// Index of the component.
    pub component: usize,
    /// Reading per unit of the signal.
    pub scale: f64,
    /// Reading at zero.
    pub offset: f64,
}

impl AnalogSource {
    /// Returns the index of the component among the plant's outputs.
    ///
    /// # Errors
    /// [`WiringError`] if the signal does not exist or has fewer components.
    pub fn find(&self, owner: &str, plant: &PlantSignals) -> Result<usize, WiringError> {
        match plant.outputs.field(&self.signal) {
            Some(field) if self.component < field.port.size => Ok(field.offset + self.component),
            _ => {
                // No signal of the plant fits this port; the error lists near misses.
                let required = Port::input(&self.signal, Unit::One, self.component + 1);
                plant.find(owner, &required).map(|range| range.start)
            }
        }
    }

    /// Returns the reading of the input for the signal value `value`.
    pub fn reading(&self, value: f64) -> f64 {
        self.scale * value + self.offset
    }
}
