use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration, signal};
use twinrig_wire::{AnalogInput, WireError, check_channels, quantize};

use super::assumed;
use super::protocol::{ANALOG, LINES, TICKS_MAX};

/// Configuration of driver and board.
#[derive(Clone, Debug, PartialEq)]
pub struct Rb110 {
    /// Name of the bus: `rb110`.
    pub name: String,
    /// Period of the pulses, 10 to 20 ms, and duration of a transfer.
    pub period: SimDuration,
    /// Lines with servos.
    pub servos: Vec<ServoLine>,
    /// Analog inputs that are read, the components of the port `NAME/adc`; no port without any.
    pub analog: Vec<AnalogInput>,
    /// Full scale of the analog inputs.
    pub range: AdcRange,
    /// Reference voltage of the analog inputs \[V\].
    pub reference: f64,
    /// Clock of the board, which times its pulses.
    pub clock: BoardClock,
}

/// Servo on a line of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoLine {
    /// Number of the line, from 0 to 15.
    pub line: usize,
    /// Name of its command \[rad\]: input port of the driver, and signal that the board actuates in
    /// the plant.
    pub command: String,
    /// Conversion between angle and pulse.
    pub pulse: PulseMap,
}

/// Conversion between the angle of a servo and its pulse, in ticks of 20 ns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PulseMap {
    /// Shortest pulse that commands an angle.
    pub least: u32,
    /// Longest pulse that commands an angle.
    pub most: u32,
    /// Pulse for 0 rad.
    pub neutral: u32,
    /// Change of the pulse per radian \[1/rad\]; negative for a servo with reversed direction.
    pub ticks_per_radian: f64,
    /// Pulse that switches the servo off; 0: no pulse.
    pub off: u32,
}

/// Full scale of the analog inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdcRange {
    /// The reference voltage.
    #[default]
    Reference,
    /// Twice the reference voltage.
    TwiceReference,
}

/// Invalid configuration of a board.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Rb110Error {
    /// The period of the pulses is outside 10 to 20 ms.
    #[error("pulses every {period}: servos require one every 10 to 20 ms")]
    Period {
        /// The period.
        period: SimDuration,
    },
    /// The pulses of a servo are inconsistent.
    #[error(
        "pulses of {command}: {map:?}: requires off < least, 0 < least ≤ neutral ≤ most ≤ {TICKS_MAX}, and ticks_per_radian finite and not 0"
    )]
    Pulse {
        /// Command of the servo.
        command: String,
        /// Its pulses.
        map: PulseMap,
    },
    /// The reference is not a positive voltage.
    #[error("a reference of {volts} V is not positive and finite")]
    Reference {
        /// The reference \[V\].
        volts: f64,
    },
    /// Invalid lines, analog inputs or faults of the wire.
    #[error(transparent)]
    Wire(#[from] WireError),
}

impl PulseMap {
    /// Servos of Oncilla: 1.10 to 1.30 ms.
    pub const ONCILLA: Self = Self {
        least: 55_000,
        most: 65_000,
        neutral: 60_000,
        ticks_per_radian: assumed::ONCILLA_TICKS_PER_RADIAN,
        off: 0,
    };
    /// Servos of Kondo: 700 to 2300 µs; 50 µs powers off.
    pub const KONDO: Self = Self {
        least: 35_000,
        most: 115_000,
        neutral: 75_000,
        ticks_per_radian: assumed::KONDO_TICKS_PER_RADIAN,
        off: 2_500,
    };

    /// Returns the pulse for `angle` \[rad\], and whether it was saturated at a limit. `None` for
    /// NaN.
    pub fn ticks(&self, angle: f64) -> Option<(u32, bool)> {
        let exact = f64::from(self.neutral) + angle * self.ticks_per_radian;
        (!exact.is_nan()).then(|| quantize(exact, self.least..=self.most))
    }

    /// Returns the angle commanded by a pulse \[rad\]; `None` if it commands none.
    pub fn angle(&self, ticks: u32) -> Option<f64> {
        let commands = (self.least..=self.most).contains(&ticks);
        commands.then(|| (f64::from(ticks) - f64::from(self.neutral)) / self.ticks_per_radian)
    }

    fn is_valid(&self) -> bool {
        let ordered = 0 < self.least && self.least <= self.neutral && self.neutral <= self.most;
        let has_slope = self.ticks_per_radian.is_finite() && self.ticks_per_radian != 0.0;
        ordered && self.most <= TICKS_MAX && self.off < self.least && has_slope
    }
}

impl AdcRange {
    /// Returns the voltage of full scale for a reference \[V\].
    pub fn full_scale(self, reference: f64) -> f64 {
        match self {
            Self::Reference => reference,
            Self::TwiceReference => 2.0 * reference,
        }
    }
}

impl Rb110 {
    /// Creates a configuration with pulses every 20 ms on these lines, for the abduction of these
    /// legs, without analog inputs.
    pub fn with_servos(name: impl Into<String>, pulse: PulseMap, lines: &[(usize, &str)]) -> Self {
        let servo = |&(line, leg): &(usize, &str)| ServoLine {
            line,
            command: signal::command(leg, "abduction"),
            pulse,
        };
        Self {
            name: name.into(),
            period: SimDuration::from_millis(20),
            servos: lines.iter().map(servo).collect(),
            analog: Vec::new(),
            range: AdcRange::default(),
            reference: assumed::REFERENCE,
            clock: BoardClock::IDEAL,
        }
    }

    pub(super) fn check(&self) -> Result<(), Rb110Error> {
        let (shortest, longest) = (SimDuration::from_millis(10), SimDuration::from_millis(20));
        if !(shortest..=longest).contains(&self.period) {
            return Err(Rb110Error::Period {
                period: self.period,
            });
        }
        if !(self.reference > 0.0 && self.reference.is_finite()) {
            return Err(Rb110Error::Reference {
                volts: self.reference,
            });
        }
        check_channels("line", LINES, self.servos.iter().map(|servo| servo.line))?;
        let channels = self.analog.iter().map(|input| input.channel);
        check_channels("analog input", ANALOG, channels)?;
        match self.servos.iter().find(|servo| !servo.pulse.is_valid()) {
            Some(servo) => Err(Rb110Error::Pulse {
                command: servo.command.clone(),
                map: servo.pulse,
            }),
            None => Ok(()),
        }
    }
}
