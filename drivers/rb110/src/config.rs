use serde::{Deserialize, Serialize};
use thiserror::Error;
use twinrig_kernel::{BoardClock, SimDuration};
use twinrig_runtime::Wire;
use twinrig_wire::{AnalogSource, Duplex, FaultSchedule, Faulty, HostEnd, Uart, WireError};

use crate::assumed;
use crate::protocol::{ANALOG, LINES, TICKS_MAX};
use crate::{Rb110Board, Rb110Driver, Rb110Emulation, Rb110Protocol};

/// What driver and board are made from. Plain data.
#[derive(Clone, Debug, PartialEq)]
pub struct Rb110 {
    /// Of the bus: `rb110`.
    pub name: String,
    /// From one pulse's start to the next one's; 10 to 20 ms. A transfer takes as long.
    pub period: SimDuration,
    /// The lines with servos.
    pub servos: Vec<ServoLine>,
    /// The analog inputs that are read; the port `NAME/adc` has as many numbers, none without any.
    pub analog: Vec<AnalogInput>,
    /// What the analog inputs reach to.
    pub range: AdcRange,
    /// The reference of the analog inputs \[V\].
    pub reference: f64,
    /// The board's clock, which times its pulses.
    pub clock: BoardClock,
}

/// A servo on one of the board's lines.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoLine {
    /// Number of the line, from 0 to 15.
    pub line: usize,
    /// The command that it carries \[rad\]: a port of the driver, and what the board actuates in the plant.
    pub command: String,
    /// What its pulses mean.
    pub pulse: PulseMap,
}

/// An analog input that is read.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalogInput {
    /// Its number, from 0 to 7.
    pub channel: usize,
    /// What is connected to it \[V\]: an input without anything reads 0. The driver does not look at it.
    pub analog_source: Option<AnalogSource>,
}

/// What the pulses of a servo mean, in ticks of 20 ns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PulseMap {
    /// Shortest that commands an angle.
    pub least: u32,
    /// Longest that does.
    pub most: u32,
    /// The pulse for 0 rad.
    pub neutral: u32,
    /// How much longer a pulse is for each radian \[1/rad\]; negative for a servo that turns the other way.
    pub ticks_per_radian: f64,
    /// The pulse with which it is left alone; 0: no pulse.
    pub off: u32,
}

/// What the analog inputs reach to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdcRange {
    /// The reference.
    #[default]
    Reference,
    /// Twice the reference.
    TwiceReference,
}

/// A board that cannot be.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Rb110Error {
    /// The pulses come too fast or too slow.
    #[error("pulses every {period}: servos take them every 10 to 20 ms")]
    Period {
        /// Their period.
        period: SimDuration,
    },
    /// There is no such line or channel, or two things are on it.
    #[error("{what} {number} of {count} is not there, or taken twice")]
    Place {
        /// What of the board.
        what: &'static str,
        /// Which.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// A servo's pulses make no sense.
    #[error(
        "pulses of {command}: {map:?}, but it takes 0 < least ≤ neutral ≤ most ≤ {TICKS_MAX}, and an angle for each"
    )]
    Pulse {
        /// Its command.
        command: String,
        /// The pulses.
        map: PulseMap,
    },
    /// The reference is not a positive voltage.
    #[error("a reference of {volts} V")]
    Reference {
        /// The reference \[V\].
        volts: f64,
    },
    /// The faults of its wire cannot be.
    #[error(transparent)]
    Wire(#[from] WireError),
}

impl PulseMap {
    /// Oncilla's: 1.10 to 1.30 ms.
    pub const ONCILLA: Self = Self {
        least: 55_000,
        most: 65_000,
        neutral: 60_000,
        ticks_per_radian: assumed::ONCILLA_TICKS_PER_RADIAN,
        off: 0,
    };
    /// Kondo's: 700 to 2300 µs; 50 µs powers off.
    pub const KONDO: Self = Self {
        least: 35_000,
        most: 115_000,
        neutral: 75_000,
        ticks_per_radian: assumed::KONDO_TICKS_PER_RADIAN,
        off: 2_500,
    };

    /// The pulse for `angle` \[rad\], and whether the angle is out of reach and the pulse that of the limit. None for what is
    /// no number.
    pub fn ticks(&self, angle: f64) -> Option<(u32, bool)> {
        let wanted = (f64::from(self.neutral) + angle * self.ticks_per_radian).round();
        if wanted.is_nan() {
            return None;
        }
        let reached = wanted.clamp(f64::from(self.least), f64::from(self.most));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between two u32"
        )]
        Some((reached as u32, reached != wanted))
    }

    /// The angle that a servo takes from a pulse \[rad\]; none if the pulse commands none.
    pub fn angle(&self, ticks: u32) -> Option<f64> {
        let commands = (self.least..=self.most).contains(&ticks);
        commands.then(|| (f64::from(ticks) - f64::from(self.neutral)) / self.ticks_per_radian)
    }

    fn is_sound(&self) -> bool {
        let ordered = 0 < self.least && self.least <= self.neutral && self.neutral <= self.most;
        let turns = self.ticks_per_radian.is_finite() && self.ticks_per_radian != 0.0;
        ordered && self.most <= TICKS_MAX && self.off < self.least && turns
    }
}

impl AdcRange {
    /// What the highest count stands for, with this reference \[V\].
    pub fn full_scale(self, reference: f64) -> f64 {
        match self {
            Self::Reference => reference,
            Self::TwiceReference => 2.0 * reference,
        }
    }
}

impl Rb110 {
    /// Pulses every 20 ms on these lines, for the abduction of these legs, and no analog input.
    pub fn with_servos(name: impl Into<String>, pulse: PulseMap, lines: &[(usize, &str)]) -> Self {
        let servo = |&(line, leg): &(usize, &str)| ServoLine {
            line,
            command: format!("leg/{leg}/abduction/command"),
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

    /// What runs on the robot.
    ///
    /// # Errors
    /// [`Rb110Error`] if there can be no such board.
    pub fn driver(&self) -> Result<Rb110Driver, Rb110Error> {
        self.check()?;
        Ok(Rb110Driver::new(Rb110Protocol::new(self.clone())))
    }

    /// What stands in for the board.
    ///
    /// # Errors
    /// [`Rb110Error`] if there can be no such board.
    pub fn board(&self) -> Result<Rb110Board, Rb110Error> {
        self.check()?;
        Ok(Rb110Board::new(Rb110Emulation::new(self.clone())))
    }

    /// Everything right of the driver: the board at the far end of a wire with those of the faults that are on
    /// `wire/NAME`.
    ///
    /// # Errors
    /// [`Rb110Error`] if there can be no such board, or no such fault.
    pub fn wire(&self, faults: &FaultSchedule) -> Result<impl Wire + use<>, Rb110Error> {
        let place = format!("wire/{}", self.name);
        let line = Duplex::new(assumed::BYTE_TIME, self.board()?);
        let line = Faulty::new(&place, assumed::BYTE_TIME, faults, line)?;
        Ok(HostEnd::new(Uart::new(assumed::BYTE_TIME, line)))
    }

    fn check(&self) -> Result<(), Rb110Error> {
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
        places("line", LINES, self.servos.iter().map(|servo| servo.line))?;
        let channels = self.analog.iter().map(|input| input.channel);
        places("analog input", ANALOG, channels)?;
        match self.servos.iter().find(|servo| !servo.pulse.is_sound()) {
            Some(servo) => Err(Rb110Error::Pulse {
                command: servo.command.clone(),
                map: servo.pulse,
            }),
            None => Ok(()),
        }
    }
}

/// Refuses places that are not there, and those that are taken.
fn places(
    what: &'static str,
    count: usize,
    taken: impl Iterator<Item = usize>,
) -> Result<(), Rb110Error> {
    let mut seen = Vec::new();
    for number in taken {
        if number >= count || seen.contains(&number) {
            return Err(Rb110Error::Place {
                what,
                number,
                count,
            });
        }
        seen.push(number);
    }
    Ok(())
}
