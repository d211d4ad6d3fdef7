use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

use crate::WireError;

/// Something that goes wrong on a wire for a while. Plain data; prints itself as a `[[fault]]` table of a scenario.
///
/// ```
/// use twinrig_kernel::{SimDuration, SimTime};
/// use twinrig_wire::{Fault, FaultKind};
///
/// let fault = Fault {
///     at: SimTime::ZERO + SimDuration::from_secs(9),
///     on: "wire/sbcp".to_owned(),
///     kind: FaultKind::Drop { probability: 0.5 },
///     lasts: SimDuration::from_millis(20),
/// };
/// let printed = r#"[[fault]]
/// at = "9 s"
/// on = "wire/sbcp"
/// kind = "drop"
/// probability = 0.5
/// for = "20 ms"
/// "#;
/// assert_eq!(fault.to_string(), printed);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// From when on.
    pub at: SimTime,
    /// Where: a whole bus, `wire/sbcp`, or one board's stub, `wire/sbcp/LF`.
    pub on: String,
    /// What.
    pub kind: FaultKind,
    /// For how long: what happens in [`at`, `at` + `lasts`).
    pub lasts: SimDuration,
}

/// What goes wrong. A *burst* is what follows without a pause of more than a byte's time; it is hit as a whole, if its first
/// byte is complete within the fault's time. Flip, unplug, stuck and babble hit the single bytes that are.
///
/// Faults at one place add up: a burst that any of them drops is lost, delays are added, and so on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// A burst is lost.
    Drop {
        /// How probable that is, from 0 to 1.
        probability: f64,
    },
    /// Bits are turned round: of the ten of a byte, start and stop bits included. A byte whose start bit is wrong is lost; one
    /// whose stop bit is wrong has a framing error ([`crate::Piece::framing_error`]).
    Flip {
        /// How probable that is for each bit, from 0 to 1.
        rate: f64,
    },
    /// A burst comes later. What follows waits for it.
    Delay {
        /// By how much.
        by: SimDuration,
    },
    /// A burst comes a second time, two bytes' time after the first.
    Duplicate {
        /// How probable that is, from 0 to 1.
        probability: f64,
    },
    /// A burst changes places with the next one; without a next one it comes when the fault is over.
    Reorder {
        /// How probable that is, from 0 to 1.
        probability: f64,
    },
    /// Nothing passes.
    Unplug {
        /// Whether the host notices, so that the run ends: a converter that is pulled out, not a bus.
        /// Only where a whole line is unplugged.
        fails: bool,
    },
    /// The line is held low: both sides hear 0x00 without end, and nothing else.
    Stuck,
    /// Somebody talks without being asked: bursts of 1 to 64 random bytes. What he talks over is lost. On a whole line
    /// both sides hear it; a node that babbles is heard by the others and hears what they say when it pauses.
    Babble {
        /// Pauses between the bursts last up to twice that; 0: none.
        pause: SimDuration,
    },
}

/// The faults of a run, and the seed of what is random about them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FaultSchedule {
    /// In any order.
    pub faults: Vec<Fault>,
    /// Seed. The streams are `PLACE/faults/out`, `PLACE/faults/in` and the like: what happens in one place changes
    /// nothing in another.
    pub seed: u64,
}

impl Fault {
    /// When it is over.
    pub fn until(&self) -> SimTime {
        let end = self.at.checked_add(self.lasts);
        end.unwrap_or(SimTime::MAX)
    }

    /// Whether `now` is within its time.
    pub fn holds(&self, now: SimTime) -> bool {
        self.at <= now && now < self.until()
    }

    /// Its probability or rate, if it has one, with the name.
    fn chance(&self) -> Option<(&'static str, f64)> {
        match self.kind {
            FaultKind::Drop { probability }
            | FaultKind::Duplicate { probability }
            | FaultKind::Reorder { probability } => Some(("probability", probability)),
            FaultKind::Flip { rate } => Some(("rate", rate)),
            _ => None,
        }
    }

    /// Refuses what is no probability.
    pub(crate) fn check(&self) -> Result<(), WireError> {
        match self.chance() {
            Some((what, value)) if !(0.0..=1.0).contains(&value) => Err(WireError::Probability {
                on: self.on.clone(),
                what,
                value,
            }),
            _ => Ok(()),
        }
    }
}

impl FaultKind {
    /// Its name in a scenario.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Drop { .. } => "drop",
            Self::Flip { .. } => "flip",
            Self::Delay { .. } => "delay",
            Self::Duplicate { .. } => "duplicate",
            Self::Reorder { .. } => "reorder",
            Self::Unplug { .. } => "unplug",
            Self::Stuck => "stuck",
            Self::Babble { .. } => "babble",
        }
    }
}

/// A time as a scenario has it: exact, in the largest unit of which it is a whole number.
struct Quantity(u64);

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")];
        let unit = units
            .iter()
            .find(|(nanos, _)| self.0.is_multiple_of(*nanos));
        let (nanos, unit) = unit.unwrap_or(&(1, "ns"));
        write!(f, "\"{} {unit}\"", self.0 / nanos)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "[[fault]]\nat = {}", Quantity(self.at.as_nanos()))?;
        writeln!(f, "on = {:?}\nkind = {:?}", self.on, self.kind.name())?;
        if let Some((what, value)) = self.chance() {
            writeln!(f, "{what} = {value:?}")?;
        }
        match &self.kind {
            FaultKind::Delay { by } => writeln!(f, "by = {}", Quantity(by.as_nanos()))?,
            FaultKind::Unplug { fails: true } => writeln!(f, "fails = true")?,
            FaultKind::Babble { pause } => writeln!(f, "pause = {}", Quantity(pause.as_nanos()))?,
            _ => {}
        }
        writeln!(f, "for = {}", Quantity(self.lasts.as_nanos()))
    }
}

/// The tables one after the other.
impl fmt::Display for FaultSchedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, fault) in self.faults.iter().enumerate() {
            let gap = if n == 0 { "" } else { "\n" };
            write!(f, "{gap}{fault}")?;
        }
        Ok(())
    }
}
