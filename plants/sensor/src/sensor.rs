//! Tactile sensor: both cells under the same load.

use serde::{Deserialize, Serialize};

use crate::error::SensorError;
use crate::low_pass::{LowPass, LowPassStep};
use crate::piezoelectric::{PiezoelectricCell, PiezoelectricState, PiezoelectricStep};
use crate::piezoresistive::{PiezoresistiveCell, ResistanceAmplifier};

/// Parameters of a tactile sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TactileParameters {
    /// Piezoresistive cell, for the load itself.
    pub piezoresistive: PiezoresistiveCell,
    /// Amplifier of the piezoresistive cell.
    pub amplifier: ResistanceAmplifier,
    /// Piezoelectric cell with its amplifier, for the changes of the load.
    pub piezoelectric: PiezoelectricCell,
    /// How far the constants of cells are from these, as a share of them \[1\], if cells differ.
    pub spread: Option<f64>,
}

/// A piezoresistive and a piezoelectric cell under the same load, with their amplifiers.
///
/// Between two calls the load is linear in time; the lags are then exact at any step.
///
/// ```
/// use twinrig_sensor::{SensorFile, TactileSensor};
///
/// let file = include_str!("../files/tactile.toml");
/// let mut sensor = TactileSensor::new(SensorFile::parse("tactile.toml", file)?.sensor()?, 0.0)?;
/// sensor.advance(1e-3, 0.5); // the load rises to 0.5 N within a millisecond
/// assert!(sensor.piezoelectric_volts() > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct TactileSensor {
    parameters: TactileParameters,
    steps: [StepFactors; 2],
    state: TactileState,
}

/// Changing state of a [`TactileSensor`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TactileState {
    force: f64,
    rate: f64,
    creep: LowPass,
    piezoelectric: PiezoelectricState,
}

/// Factors for a step of one length.
#[derive(Clone, Copy, Debug, Default)]
struct StepFactors {
    seconds: f64,
    creep: LowPassStep,
    piezoelectric: PiezoelectricStep,
}

impl TactileSensor {
    /// Creates a sensor under a load that has been constant \[N\], not crept.
    ///
    /// # Errors
    /// [`SensorError::EqualTimes`].
    pub fn new(parameters: TactileParameters, force: f64) -> Result<Self, SensorError> {
        parameters.piezoelectric.check()?;
        Ok(Self {
            parameters,
            steps: [StepFactors::default(); 2],
            state: TactileState {
                force,
                piezoelectric: PiezoelectricState::resting_at(force),
                ..TactileState::default()
            },
        })
    }

    /// Advances by a step \[s\] to a load \[N\].
    pub fn advance(&mut self, seconds: f64, force: f64) {
        let factors = self.factors(seconds);
        let state = &mut self.state;
        let from = state.force;
        state
            .piezoelectric
            .advance(&factors.piezoelectric, from, force);
        state.creep.advance(&factors.creep, from, force);
        state.rate = (force - from) / seconds;
        state.force = force;
    }

    /// Returns the factors of a step. Boards with clocks of their own make a plant alternate
    /// between a few lengths; the last two are kept.
    fn factors(&mut self, seconds: f64) -> StepFactors {
        if self.steps[0].seconds == seconds {
            return self.steps[0];
        }
        self.steps.swap(0, 1);
        if self.steps[0].seconds != seconds {
            self.steps[0] = StepFactors {
                seconds,
                creep: LowPassStep::new(self.parameters.piezoresistive.creep.time, seconds),
                piezoelectric: self.parameters.piezoelectric.step(seconds),
            };
        }
        self.steps[0]
    }

    /// Conductance of the piezoresistive cell \[S\].
    pub fn conductance(&self) -> f64 {
        let TactileState {
            force, rate, creep, ..
        } = self.state;
        let cell = &self.parameters.piezoresistive;
        cell.conductance(force, rate, creep.value)
    }

    /// Voltage of the piezoresistive cell's amplifier \[V\].
    pub fn piezoresistive_volts(&self) -> f64 {
        self.parameters.amplifier.volts(self.conductance())
    }

    /// Voltage of the charge amplifier \[V\].
    pub fn piezoelectric_volts(&self) -> f64 {
        let cell = &self.parameters.piezoelectric;
        cell.volts(&self.state.piezoelectric)
    }

    /// Returns the state.
    pub fn state(&self) -> TactileState {
        self.state
    }

    /// Restores a state.
    pub fn set_state(&mut self, state: TactileState) {
        self.state = state;
    }
}
