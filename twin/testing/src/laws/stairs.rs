use std::ops::Range;

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{PlantAccess, PlantFault, PlantSignals};

use super::setup::Levels;

/// Periods that a level lasts.
pub(super) const PERIODS_PER_LEVEL: u64 = 3;

/// Plant whose outputs rise in steps, and which records its inputs.
#[derive(Clone)]
pub(super) struct Stairs {
    levels: Levels,
    period: SimDuration,
    pub(super) now: SimTime,
    pub(super) inputs: Vec<f64>,
    outputs: Vec<f64>,
}

impl Stairs {
    pub(super) fn new(signals: &PlantSignals, levels: &Levels, period: SimDuration) -> Self {
        Self {
            levels: levels.clone(),
            period,
            now: SimTime::ZERO,
            inputs: vec![0.0; signals.inputs.len()],
            outputs: vec![0.0; signals.outputs.len()],
        }
    }

    /// Returns the level at present. Its edges are within a period, away from the transfers.
    fn level(&self) -> usize {
        let period = self.period.as_nanos().max(1);
        let shifted = self.now.as_nanos() + period * 5 / 8;
        usize::try_from(shifted / (period * PERIODS_PER_LEVEL)).unwrap_or(usize::MAX)
    }
}

impl PlantAccess for Stairs {
    fn sample(&mut self, signals: Range<usize>) -> Result<&[f64], PlantFault> {
        let level = self.level();
        for component in signals.clone() {
            self.outputs[component] = (self.levels)(level, component);
        }
        Ok(&self.outputs[signals])
    }

    fn actuate(&mut self, signals: Range<usize>) -> Result<&mut [f64], PlantFault> {
        Ok(&mut self.inputs[signals])
    }
}
