use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration, SimTime};
use twinrig_runtime::{Timing, TimingError};
use twinrig_wire::{AnalogInput, AnalogSource, SampleChoice, WireError, check_channels};

use crate::assumed::{
    BAUD, JITTER, REFERENCE_CAPACITY, REFERENCE_NOISE, REFERENCE_SENSITIVITY, VOLTAGE_NOISE,
};
use crate::protocol::{DATA_LENGTH, OVERSAMPLING, PERIOD_STEP_US};

/// Names of the channels, in the order of their numbers: two voltages and the bridge.
pub const CHANNELS: [&str; 3] = ["piezoresistive", "piezoelectric", "reference"];

/// Configuration of driver and board.
#[derive(Clone, Debug, PartialEq)]
pub struct Tactile {
    /// Name of the bus: `tactile`.
    pub name: String,
    /// Signal of the force at which the sensors are mounted: `bench/force`. The driver's outputs
    /// are below it.
    pub signal: String,
    /// Time between two samples: 1 to 65 ms, in steps of 1 ms.
    pub period: SimDuration,
    /// Conversions per sample, of which the mean is reported: 1, 2 or 4.
    pub oversampling: u8,
    /// Sample that a transfer returns.
    pub take: SampleChoice,
    /// Whether the force of the reference cell at the start becomes its zero.
    pub zero: bool,
    /// Symbol rate of the line \[baud\]. ASSUMED: 921 600.
    pub baud: u32,
    /// Reference cell.
    pub reference: ReferenceCell,
    /// Measured quantities: voltages of channels 0 and 1 \[V\], force of channel 2 \[N\]; by
    /// default the signals below `signal`. Like all that follows, not used by the driver.
    pub inputs: Vec<AnalogInput>,
    /// Deviations of the noise of a conversion \[V, V, N\].
    pub noise: [f64; 3],
    /// Delay of the start of a transmission by the board's firmware.
    pub jitter: Timing,
    /// Times at which the board is reset: it forgets that it was started, its clock begins at 0,
    /// and it accepts commands after 100 ms.
    pub resets: Vec<SimTime>,
    /// Cables of sensors that are unplugged for a time: their channels then read 0, with noise.
    pub unplugged: Vec<Unplugged>,
    /// Clock of the board.
    pub clock: BoardClock,
    /// Seed of noise and jitter: streams `NAME/noise` and `NAME/jitter`.
    pub seed: u64,
}

/// Cable of a sensor that is unplugged for a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unplugged {
    /// Number of the channel.
    pub channel: usize,
    /// Start.
    pub from: SimTime,
    /// End.
    pub to: SimTime,
}

impl Unplugged {
    /// Returns whether a channel is unplugged at this time.
    pub(crate) fn includes(&self, channel: usize, now: SimTime) -> bool {
        channel == self.channel && (self.from..self.to).contains(&now)
    }
}

/// Reference cell at the bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceCell {
    /// Nominal force \[N\]; beyond it a sample is marked as saturated.
    pub capacity: f64,
    /// Output over supply at the nominal force \[1\]: 0.002 for 2 mV/V.
    pub sensitivity: f64,
}

/// Invalid configuration of a board.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TactileError {
    /// The period is not supported by the board.
    #[error("a period of {period} is not a multiple of 1 ms up to 65 ms")]
    Period {
        /// The period.
        period: SimDuration,
    },
    /// The oversampling is not supported by the board.
    #[error("{conversions} conversions per sample are not supported: 1, 2 or 4")]
    Oversampling {
        /// Conversions per sample.
        conversions: u8,
    },
    /// The symbol rate is too low or too high.
    #[error("a symbol rate of {baud} baud is not between 1200 and 100 000 000")]
    Baud {
        /// The rate.
        baud: u32,
    },
    /// A number of the reference cell is not positive and finite.
    #[error("the {what} of the reference cell, {value}, is not positive and finite")]
    Reference {
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A deviation of the noise is negative or not finite.
    #[error("a deviation of {deviation} of the noise of {channel} is negative or not finite")]
    Noise {
        /// Name of the channel.
        channel: &'static str,
        /// The deviation.
        deviation: f64,
    },
    /// Invalid jitter.
    #[error("jitter of the transmissions: {0}")]
    Jitter(#[from] TimingError),
    /// Invalid inputs or faults of the wire.
    #[error(transparent)]
    Wire(#[from] WireError),
}

impl Default for ReferenceCell {
    /// The cell of the thesis, 50 N, with 2 mV/V (ASSUMED).
    fn default() -> Self {
        Self {
            capacity: REFERENCE_CAPACITY,
            sensitivity: REFERENCE_SENSITIVITY,
        }
    }
}

impl Tactile {
    /// Creates the configuration of the bench: 1 kHz, one conversion per sample, the newest sample,
    /// zero as it is; the board with an ideal clock, the noise of its cards (ASSUMED), and up to 50
    /// µs of jitter (ASSUMED).
    pub fn new(name: impl Into<String>, signal: impl Into<String>) -> Self {
        let signal = signal.into();
        let inputs = CHANNELS.iter().enumerate();
        let inputs = inputs.map(|(channel, quantity)| AnalogInput {
            channel,
            analog_source: Some(AnalogSource {
                signal: format!("{signal}/{quantity}"),
                component: 0,
                scale: 1.0,
                offset: 0.0,
            }),
        });
        Self {
            name: name.into(),
            inputs: inputs.collect(),
            signal,
            period: SimDuration::from_millis(1),
            oversampling: 1,
            take: SampleChoice::default(),
            zero: false,
            baud: BAUD,
            reference: ReferenceCell::default(),
            noise: [VOLTAGE_NOISE, VOLTAGE_NOISE, REFERENCE_NOISE],
            jitter: Timing::Uniform {
                min: SimDuration::ZERO,
                max: JITTER,
            },
            resets: Vec::new(),
            unplugged: Vec::new(),
            clock: BoardClock::IDEAL,
            seed: 0,
        }
    }

    /// Time of a byte on the line, rounded up: start bit, eight data bits, stop bit.
    pub(crate) fn byte_time(&self) -> SimDuration {
        SimDuration::from_nanos(10_000_000_000_u64.div_ceil(u64::from(self.baud)))
    }

    /// Time from the instant of a sample, the middle of its conversions, to the end of its frame.
    pub(crate) fn transport(&self) -> SimDuration {
        self.half_window() + self.byte_time() * DATA_LENGTH as u64
    }

    /// Time from the middle of the conversions of a sample to the last one.
    pub(crate) fn half_window(&self) -> SimDuration {
        let conversions = u64::from(self.oversampling);
        SimDuration::from_nanos(self.period.as_nanos() * (conversions - 1) / (2 * conversions))
    }

    pub(crate) fn check(&self) -> Result<(), TactileError> {
        let period = self.period;
        let step = SimDuration::from_micros(u64::from(PERIOD_STEP_US));
        let most = SimDuration::from_micros(u64::from(u16::MAX));
        if period.is_zero() || !period.is_multiple_of(step) || period > most {
            return Err(TactileError::Period { period });
        }
        if !OVERSAMPLING.contains(&self.oversampling) {
            return Err(TactileError::Oversampling {
                conversions: self.oversampling,
            });
        }
        let baud = self.baud;
        if !(1200..=100_000_000).contains(&baud) {
            return Err(TactileError::Baud { baud });
        }
        let cell = self.reference;
        for (what, value) in [
            ("capacity", cell.capacity),
            ("sensitivity", cell.sensitivity),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(TactileError::Reference { what, value });
            }
        }
        for (channel, deviation) in CHANNELS.into_iter().zip(self.noise) {
            if !(deviation >= 0.0 && deviation.is_finite()) {
                return Err(TactileError::Noise { channel, deviation });
            }
        }
        self.jitter.clone().source(self.seed, "")?;
        let channels = self.inputs.iter().map(|input| input.channel);
        Ok(check_channels("input", CHANNELS.len(), channels)?)
    }
}
