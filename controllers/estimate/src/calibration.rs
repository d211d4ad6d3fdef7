//! Constants of a sensor as an identification found them.

use crate::amplifier::ChargeAmplifier;
use crate::error::EstimateError;
use crate::fit::CreepFit;
use crate::model::Decay;
use crate::response::{ForceResponse, Hysteresis};

/// Everything that filters know of a sensor: found from recorded forces and voltages, never from
/// the constants of a simulated cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Response of the piezoresistive cell over the whole of the identification, creep included
    /// (eq. 4.21): of the filters without a state of creep.
    pub hysteresis: Hysteresis,
    /// Deviation of the residuals of that response \[V\].
    pub hysteresis_residual: f64,
    /// Response with its creep apart: of F4.
    pub creep: CreepFit,
    /// Deviation of the residuals of that response \[V\].
    pub creep_residual: f64,
    /// Gain of the piezoelectric cell as a rate sensor \[V·s/N\]: of F1.
    pub rate_gain: f64,
    /// Coefficient of the rate for sinusoidal loads, in V·s/N: of F2.
    pub rate: Decay,
    /// Coefficient of the acceleration for sinusoidal loads, in V·s²/N: of F2.
    pub acceleration: Decay,
    /// Cell with charge amplifier: of F3 and F4.
    pub amplifier: ChargeAmplifier,
    /// Deviation of the residuals of the charge amplifier \[V\].
    pub amplifier_residual: f64,
}

impl Calibration {
    /// Returns the response of the piezoresistive cell for a filter with a state of creep, or
    /// without.
    pub fn response(&self, with_creep: bool) -> ForceResponse {
        ForceResponse::Hysteresis(if with_creep {
            self.creep.hysteresis
        } else {
            self.hysteresis
        })
    }

    /// Checks all constants.
    ///
    /// # Errors
    /// [`EstimateError`] with the name of the first invalid one.
    pub fn check(&self) -> Result<(), EstimateError> {
        self.response(false).check()?;
        self.response(true).check()?;
        self.amplifier.check()
    }
}
