use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_runtime::Wire;
use twinrig_wire::{Duplex, FaultSchedule, Faulty, HostEnd, Uart, WireError};

use crate::assumed;
use crate::{
    Cutoff, OptoForceDriver, OptoForceEmulation, OptoForceProtocol, OptoForceSensor, Speed,
};

/// What driver and sensor are made from. Plain data.
#[derive(Clone, Debug, PartialEq)]
pub struct OptoForce {
    /// Of the bus: `optoforce`.
    pub name: String,
    /// How fast it sends.
    pub speed: Speed,
    /// What it filters.
    pub cutoff: Cutoff,
    /// Whether what it measures at the beginning counts as no force.
    pub zero: bool,
    /// Which sample a transfer brings.
    pub take: Take,
    /// Counts of a newton \[1/N\]: of this very sensor.
    pub sensitivity: f64,
    /// The force in the plant that it measures \[N, 3\]. The driver does not look at it.
    pub signal: String,
    /// The sensor's clock.
    pub clock: BoardClock,
}

/// Which sample a transfer brings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Take {
    /// The newest there is: the transfer takes no time.
    #[default]
    Newest,
    /// The next one that comes, within two periods of the sensor: then the newest there is.
    Fresh,
}

/// A sensor that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OptoForceError {
    /// A count must be some force.
    #[error("a sensitivity of {counts} counts a newton")]
    Sensitivity {
        /// The sensitivity \[1/N\].
        counts: f64,
    },
    /// The driver could wait for ever.
    #[error("a sensor whose speed is 0 sends nothing")]
    Stopped,
    /// The faults of its wire cannot be.
    #[error(transparent)]
    Wire(#[from] WireError),
}

/// A byte at 1 Mbaud, 8N1.
const BYTE_TIME: SimDuration = SimDuration::from_micros(10);

impl OptoForce {
    /// Counts at which an axis is at its end. ASSUMED.
    pub const COUNTS: f64 = assumed::NOMINAL_COUNTS;

    /// An OMD-30-FF-1600N as it comes: 100 Hz, 15 Hz, nothing zeroed.
    pub fn new(name: impl Into<String>, signal: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            speed: Speed::default(),
            cutoff: Cutoff::default(),
            zero: false,
            take: Take::default(),
            sensitivity: assumed::NOMINAL_COUNTS / assumed::NOMINAL_FORCE,
            signal: signal.into(),
            clock: BoardClock::IDEAL,
        }
    }

    /// What runs on the robot.
    ///
    /// # Errors
    /// [`OptoForceError`] if there can be no such sensor.
    pub fn driver(&self) -> Result<OptoForceDriver, OptoForceError> {
        self.check()?;
        Ok(OptoForceDriver::new(OptoForceProtocol::new(self.clone())))
    }

    /// What stands in for the sensor.
    ///
    /// # Errors
    /// [`OptoForceError`] if there can be no such sensor.
    pub fn sensor(&self) -> Result<OptoForceSensor, OptoForceError> {
        self.check()?;
        Ok(OptoForceSensor::new(OptoForceEmulation::new(self.clone())))
    }

    /// Everything right of the driver: the sensor at the far end of a wire with those of the faults that are on
    /// `wire/NAME`.
    ///
    /// # Errors
    /// [`OptoForceError`] if there can be no such sensor, or no such fault.
    pub fn wire(&self, faults: &FaultSchedule) -> Result<impl Wire + use<>, OptoForceError> {
        let place = format!("wire/{}", self.name);
        let line = Duplex::new(BYTE_TIME, self.sensor()?);
        let line = Faulty::new(&place, BYTE_TIME, faults, line)?;
        Ok(HostEnd::new(Uart::new(BYTE_TIME, line)))
    }

    fn check(&self) -> Result<(), OptoForceError> {
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
