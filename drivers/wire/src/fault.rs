use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

use crate::WireError;

/// Temporary fault of a transport. Plain data; its `Display` is a `[[fault]]` table of a scenario.
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
    /// Start time.
    pub at: SimTime,
    /// Place: a whole bus, `wire/sbcp`, or the stub of one board, `wire/sbcp/LF`.
    pub on: String,
    /// Kind.
    pub kind: FaultKind,
    /// Duration: the fault is active in [`at`, `at` + `lasts`).
    pub lasts: SimDuration,
}

/// Kind of a fault. A *burst* is a sequence of bytes with pauses of at most one byte time; a fault
/// affects a burst as a whole if its first byte is complete while the fault is active. Flip,
/// unplug, stuck and babble affect single bytes.
///
/// Faults at one place combine: a burst dropped by any of them is lost, delays add up, and so on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// A burst is lost.
    Drop {
        /// Probability, from 0 to 1.
        probability: f64,
    },
    /// Bits are flipped, of the ten of a byte including start and stop bit. A byte with a wrong
    /// start bit is lost; a wrong stop bit is a framing error ([`crate::Piece::framing_error`]).
    Flip {
        /// Probability per bit, from 0 to 1.
        rate: f64,
    },
    /// A burst is delayed. The bytes behind it are queued.
    Delay {
        /// Delay.
        by: SimDuration,
    },
    /// A burst is repeated, two byte times after the first.
    Duplicate {
        /// Probability, from 0 to 1.
        probability: f64,
    },
    /// A burst swaps places with the next one; without a next one it is released when the fault
    /// ends.
    Reorder {
        /// Probability, from 0 to 1.
        probability: f64,
    },
    /// No bytes pass.
    Unplug {
        /// Whether the host detects the disconnection, which ends the run: an unplugged converter,
        /// as opposed to a disconnected bus. Has an effect on whole lines only.
        fails: bool,
    },
    /// The line is held low: both sides receive 0x00 continuously and nothing else.
    Stuck,
    /// Unsolicited transmissions (babbling): bursts of 1 to 64 random bytes. Bytes that overlap
    /// them are lost. On a whole line both sides receive them; the bursts of a babbling node are
    /// received by the others, and the node receives in their pauses.
    Babble {
        /// Pauses between the bursts are uniform in 0 to twice this duration; 0: none.
        pause: SimDuration,
    },
}

/// Faults of a run with the seed of their random draws.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FaultSchedule {
    /// In any order.
    pub faults: Vec<Fault>,
    /// Seed of the streams `PLACE/faults/out`, `PLACE/faults/in` and so on: the draws at different
    /// places are independent.
    pub seed: u64,
}

impl Fault {
    /// End time.
    pub fn until(&self) -> SimTime {
        let end = self.at.checked_add(self.lasts);
        end.unwrap_or(SimTime::MAX)
    }

    /// Whether the fault is active at `now`.
    pub fn holds(&self, now: SimTime) -> bool {
        self.at <= now && now < self.until()
    }

    /// Returns the probability or rate of the fault, if it has one, with its name.
    fn chance(&self) -> Option<(&'static str, f64)> {
        match self.kind {
            FaultKind::Drop { probability }
            | FaultKind::Duplicate { probability }
            | FaultKind::Reorder { probability } => Some(("probability", probability)),
            FaultKind::Flip { rate } => Some(("rate", rate)),
            _ => None,
        }
    }

    /// Checks that the probability or rate lies in \[0, 1\].
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
    /// Returns the name in a scenario.
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

/// Duration in the notation of a scenario: exact, in the largest unit of which it is an integer
/// multiple.
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

/// The tables in order, separated by blank lines.
impl fmt::Display for FaultSchedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, fault) in self.faults.iter().enumerate() {
            let gap = if n == 0 { "" } else { "\n" };
            write!(f, "{gap}{fault}")?;
        }
        Ok(())
    }
}
