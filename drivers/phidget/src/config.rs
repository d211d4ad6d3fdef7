use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_runtime::Wire;
use twinrig_wire::{AnalogSource, Duplex, FaultSchedule, Faulty, HostEnd, Uart, WireError};

use crate::assumed::{BYTE_TIME, POLL};
use crate::protocol::{ANALOG, BRIDGES, Gain, INTERVAL_MS_MAX, SCALE, Setup};
use crate::{PhidgetBoard, PhidgetDriver, PhidgetEmulation, PhidgetProtocol};

/// What driver and board are made from. Plain data.
#[derive(Clone, Debug, PartialEq)]
pub struct Phidget {
    /// Of the bus: `phidget`.
    pub name: String,
    /// Which board it is, and how it is set up.
    pub board: Board,
    /// What is connected to its inputs; one without anything reads 0. The driver does not look at it.
    pub inputs: Vec<Input>,
    /// The board's clock.
    pub clock: BoardClock,
}

/// The boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// 1046. The port `NAME/bridge` has four ratios \[1\]: output of a bridge over its supply, 0.001 for a millivolt a volt.
    Bridge {
        /// From one report to the next: 8 to 1000 ms, in steps of 8.
        interval: SimDuration,
        /// How much the ratios are amplified: they reach to one over that.
        gain: Gain,
    },
    /// 1018. The port `NAME/analog` has eight voltages \[V\].
    InterfaceKit {
        /// By how much an input changes before it is reported, in thousandths of 5 V; 0: always.
        trigger: u16,
    },
}

/// Something that is connected to an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The number of the input, from 0 on.
    pub channel: usize,
    /// What it reads: a ratio \[1\] at a bridge, a voltage \[V\] at an interface kit.
    pub analog_source: AnalogSource,
}

/// A board that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PhidgetError {
    /// The board cannot report like that.
    #[error("a data interval of {interval}: it takes a multiple of {POLL} up to 1 s")]
    Interval {
        /// The interval.
        interval: SimDuration,
    },
    /// An input never changes by so much.
    #[error("a change trigger of {trigger}: inputs read 0 to {SCALE}")]
    Trigger {
        /// The trigger.
        trigger: u16,
    },
    /// There is no such input, or two things are on it.
    #[error("input {channel} of {count} is not there, or taken twice")]
    Channel {
        /// Which.
        channel: usize,
        /// How many there are.
        count: usize,
    },
    /// The faults of its wire cannot be.
    #[error(transparent)]
    Wire(#[from] WireError),
}

impl Default for Board {
    /// The bridge at its fastest, unamplified.
    fn default() -> Self {
        Self::Bridge {
            interval: POLL,
            gain: Gain::X1,
        }
    }
}

impl Board {
    /// The interface kit as it comes.
    pub const INTERFACE_KIT: Self = Self::InterfaceKit { trigger: 10 };

    /// How many inputs it has.
    pub const fn channels(self) -> usize {
        match self {
            Self::Bridge { .. } => BRIDGES,
            Self::InterfaceKit { .. } => ANALOG,
        }
    }

    /// The longest time without a report that is no reason to worry.
    pub(crate) const fn interval(self) -> SimDuration {
        match self {
            Self::Bridge { interval, .. } => interval,
            Self::InterfaceKit { .. } => POLL,
        }
    }

    pub(crate) fn setup(self) -> Setup {
        match self {
            Self::Bridge { interval, gain } => Setup::Bridge {
                // As `check` has seen, it fits.
                interval_ms: u16::try_from(interval.as_nanos() / 1_000_000).unwrap_or(u16::MAX),
                gain,
            },
            Self::InterfaceKit { trigger } => Setup::InterfaceKit { trigger },
        }
    }
}

impl Phidget {
    /// A board without anything at its inputs.
    pub fn new(name: impl Into<String>, board: Board) -> Self {
        Self {
            name: name.into(),
            board,
            inputs: Vec::new(),
            clock: BoardClock::IDEAL,
        }
    }

    /// What runs on the robot.
    ///
    /// # Errors
    /// [`PhidgetError`] if there can be no such board.
    pub fn driver(&self) -> Result<PhidgetDriver, PhidgetError> {
        self.check()?;
        Ok(PhidgetDriver::new(PhidgetProtocol::new(self.clone())))
    }

    /// What stands in for the board.
    ///
    /// # Errors
    /// [`PhidgetError`] if there can be no such board.
    pub fn board(&self) -> Result<PhidgetBoard, PhidgetError> {
        self.check()?;
        Ok(PhidgetBoard::new(PhidgetEmulation::new(self.clone())))
    }

    /// Everything right of the driver: the board at the far end of a wire with those of the faults that are on
    /// `wire/NAME`.
    ///
    /// # Errors
    /// [`PhidgetError`] if there can be no such board, or no such fault.
    pub fn wire(&self, faults: &FaultSchedule) -> Result<impl Wire + use<>, PhidgetError> {
        let place = format!("wire/{}", self.name);
        let line = Duplex::new(BYTE_TIME, self.board()?);
        let line = Faulty::new(&place, BYTE_TIME, faults, line)?;
        Ok(HostEnd::new(Uart::new(BYTE_TIME, line)))
    }

    fn check(&self) -> Result<(), PhidgetError> {
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
        let count = self.board.channels();
        let channels: Vec<usize> = self.inputs.iter().map(|input| input.channel).collect();
        for (n, &channel) in channels.iter().enumerate() {
            if channel >= count || channels[..n].contains(&channel) {
                return Err(PhidgetError::Channel { channel, count });
            }
        }
        Ok(())
    }
}
