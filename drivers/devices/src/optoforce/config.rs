use thiserror::Error;
use twinrig_kernel::BoardClock;
use twinrig_wire::{SampleChoice, WireError};

use super::assumed;
use super::{Cutoff, Speed};

/// Configuration of driver and sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct OptoForce {
    /// Name of the bus: `optoforce`.
    pub name: String,
    /// Output rate.
    pub speed: Speed,
    /// Cut-off frequency of the filter.
    pub cutoff: Cutoff,
    /// Whether the force at the start is subtracted as offset.
    pub zero: bool,
    /// Sample that a transfer returns.
    pub take: SampleChoice,
    /// Sensitivity of the individual sensor \[counts/N\].
    pub sensitivity: f64,
    /// Signal of the measured force in the plant \[N, 3\]. Not used by the driver.
    pub signal: String,
    /// Clock of the sensor.
    pub clock: BoardClock,
}

/// Invalid configuration of a sensor.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OptoForceError {
    /// The sensitivity is not positive and finite.
    #[error("a sensitivity of {counts} counts per newton is not positive and finite")]
    Sensitivity {
        /// The sensitivity \[1/N\].
        counts: f64,
    },
    /// The output rate is 0: the driver would wait indefinitely.
    #[error("a sensor with speed 0 sends no samples")]
    Stopped,
    /// Invalid faults of the wire.
    #[error(transparent)]
    Wire(#[from] WireError),
}

impl OptoForce {
    /// Full scale of an axis \[counts\]. ASSUMED.
    pub const COUNTS: f64 = assumed::NOMINAL_COUNTS as f64;

    /// Creates the configuration of an OMD-30-FF-1600N with factory settings: 100 Hz, cut-off at 15
    /// Hz, no offset.
    pub fn new(name: impl Into<String>, signal: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            speed: Speed::default(),
            cutoff: Cutoff::default(),
            zero: false,
            take: SampleChoice::default(),
            sensitivity: Self::COUNTS / assumed::NOMINAL_FORCE,
            signal: signal.into(),
            clock: BoardClock::IDEAL,
        }
    }

    pub(super) fn check(&self) -> Result<(), OptoForceError> {
        if !(self.sensitivity > 0.0 && self.sensitivity.is_finite()) {
            return Err(OptoForceError::Sensitivity {
                counts: self.sensitivity,
            });
        }
        match self.speed {
            Speed::Stop => Err(OptoForceError::Stopped),
            _ => Ok(()),
        }
    }
}
