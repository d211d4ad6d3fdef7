use std::ops::Range;

use twinrig_kernel::{Port, Unit};
use twinrig_runtime::{PlantAccess, PlantFault, PlantSignals};

use crate::config::JointSignals;

/// Joint that stands still, whatever its motor does.
pub(super) struct Stand {
    outputs: Vec<f64>,
    inputs: Vec<f64>,
}

impl Stand {
    /// Creates it with its signals.
    pub(super) fn new(joint: &JointSignals) -> (Self, PlantSignals) {
        let signals = PlantSignals::of(&[
            Port::output(&joint.angle, Unit::Radian, 1),
            Port::output(&joint.rate, Unit::RadianPerSecond, 1),
            Port::input(&joint.duty, Unit::One, 1),
            Port::input(&joint.bridge, Unit::One, 1),
        ]);
        let stand = Self {
            outputs: vec![0.0; signals.outputs.len()],
            inputs: vec![0.0; signals.inputs.len()],
        };
        (stand, signals)
    }
}

impl PlantAccess for Stand {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        Ok(&self.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut self.inputs[signals])
    }
}
