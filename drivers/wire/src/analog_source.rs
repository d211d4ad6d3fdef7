use twinrig_kernel::{Port, Unit};
use twinrig_runtime::{PlantSignals, WiringError};

/// One number of a signal of the plant as an analog input of a board sees it: in whatever unit the signal has.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogSource {
    /// Name of the signal.
    pub signal: String,
    /// Which of its numbers.
    pub component: usize,
    /// What the input reads for one unit of the signal.
    pub scale: f64,
    /// What it reads for zero.
    pub offset: f64,
}

impl AnalogSource {
    /// Where that number lies among the plant's outputs.
    ///
    /// # Errors
    /// [`WiringError`] if there is no such signal, or it has fewer numbers.
    pub fn find(&self, owner: &str, plant: &PlantSignals) -> Result<usize, WiringError> {
        match plant.outputs.field(&self.signal) {
            Some(field) if self.component < field.port.size => Ok(field.offset + self.component),
            _ => {
                // No signal of the plant fits this port; the error says which come near.
                let wanted = Port::input(&self.signal, Unit::One, self.component + 1);
                plant.find(owner, &wanted).map(|range| range.start)
            }
        }
    }

    /// What the input reads while the signal is `value`.
    pub fn reading(&self, value: f64) -> f64 {
        self.scale * value + self.offset
    }
}
