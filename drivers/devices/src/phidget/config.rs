use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_wire::{AnalogInput, WireError, check_channels};

use super::assumed::POLL;
use super::protocol::{ANALOG, BRIDGES, Gain, INTERVAL_MS_MAX, SCALE, Setup};

/// Configuration of driver and board.
#[derive(Clone, Debug, PartialEq)]
pub struct Phidget {
    /// Name of the bus: `phidget`.
    pub name: String,
    /// Type and set-up of the board.
    pub board: Board,
    /// Connected inputs: ratios \[1\] of a bridge, voltages \[V\] of an interface kit. The others
    /// read 0.
    pub inputs: Vec<AnalogInput>,
    /// Clock of the board.
    pub clock: BoardClock,
}

/// Type and set-up of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// Bridge (1046). The port `NAME/bridge` has four ratios \[1\]: output voltage of a bridge over
    /// its supply, 0.001 for 1 mV/V.
    Bridge {
        /// Time between two reports: 8 to 1000 ms, in steps of 8 ms.
        interval: SimDuration,
        /// Gain; full scale of the ratios is its inverse.
        gain: Gain,
    },
    /// Interface kit (1018). The port `NAME/analog` has eight voltages \[V\].
    InterfaceKit {
        /// Change of an input that triggers a report, in thousandths of 5 V; 0: always.
        trigger: u16,
    },
}

/// Invalid configuration of a board.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PhidgetError {
    /// The data interval is not supported by the board.
    #[error("a data interval of {interval} is not a multiple of {POLL} up to 1 s")]
    Interval {
        /// The interval.
        interval: SimDuration,
    },
    /// The change trigger exceeds the range of an input.
    #[error("a change trigger of {trigger} exceeds the range of the inputs, 0 to {SCALE}")]
    Trigger {
        /// The trigger.
        trigger: u16,
    },
    /// Invalid inputs or faults of the wire.
    #[error(transparent)]
    Wire(#[from] WireError),
}

impl Default for Board {
    /// Bridge with the shortest interval and gain 1.
    fn default() -> Self {
        Self::Bridge {
            interval: POLL,
            gain: Gain::X1,
        }
    }
}

impl Board {
    /// Interface kit with factory settings.
    pub const INTERFACE_KIT: Self = Self::InterfaceKit { trigger: 10 };

    /// Returns the number of inputs.
    pub const fn channels(self) -> usize {
        match self {
            Self::Bridge { .. } => BRIDGES,
            Self::InterfaceKit { .. } => ANALOG,
        }
    }

    /// Returns the expected maximum time from a set-up to the first report.
    pub(crate) const fn interval(self) -> SimDuration {
        match self {
            Self::Bridge { interval, .. } => interval,
            Self::InterfaceKit { .. } => POLL,
        }
    }

    pub(crate) fn setup(self) -> Setup {
        match self {
            Self::Bridge { interval, gain } => Setup::Bridge {
                // Fits, as validated by `check`.
                interval_ms: u16::try_from(interval.as_nanos() / 1_000_000).unwrap_or(u16::MAX),
                gain,
            },
            Self::InterfaceKit { trigger } => Setup::InterfaceKit { trigger },
        }
    }
}

impl Phidget {
    /// Creates a configuration without signals at the inputs.
    pub fn new(name: impl Into<String>, board: Board) -> Self {
        Self {
            name: name.into(),
            board,
            inputs: Vec::new(),
            clock: BoardClock::IDEAL,
        }
    }

    pub(super) fn check(&self) -> Result<(), PhidgetError> {
        match self.board {
            Board::Bridge { interval, .. } => {
                let most = SimDuration::from_millis(u64::from(INTERVAL_MS_MAX));
                if interval.is_zero() || !interval.is_multiple_of(POLL) || interval > most {
                    return Err(PhidgetError::Interval { interval });
                }
            }
            Board::InterfaceKit { trigger } if trigger > SCALE => {
                return Err(PhidgetError::Trigger { trigger });
            }
            Board::InterfaceKit { .. } => {}
        }
        let channels = self.inputs.iter().map(|input| input.channel);
        Ok(check_channels("input", self.board.channels(), channels)?)
    }
}
