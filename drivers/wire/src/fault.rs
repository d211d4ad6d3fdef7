use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{FaultKind, FaultSelection, FrameCount};

use crate::WireError;

/// Temporary fault of a transport. Plain data; its `Display` is a `[[fault]]` table of a scenario.
///
/// ```
/// use twinrig_kernel::{SimDuration, SimTime};
/// use twinrig_wire::{Fault, FaultKind, FaultSelection, FrameChoice, FrameCount};
///
/// let fault = Fault {
///     at: SimTime::ZERO + SimDuration::from_secs(9),
///     on: "wire/sbcp".to_owned(),
///     kind: FaultKind::Drop { probability: 0.5 },
///     lasts: SimDuration::from_millis(20),
///     select: FaultSelection {
///         frames: Some(FrameChoice { after: None, count: FrameCount::Every(7) }),
///         ..FaultSelection::default()
///     },
/// };
/// let printed = r#"[[fault]]
/// at = "9 s"
/// on = "wire/sbcp"
/// kind = "drop"
/// probability = 0.5
/// on_frame = { every = 7 }
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
    /// Part of the traffic in that time.
    pub select: FaultSelection,
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

    /// Checks that the probability or rate lies in \[0, 1\], and that the fault can act on the part
    /// of the traffic that it selects.
    pub(crate) fn check(&self) -> Result<(), WireError> {
        let on = || self.on.clone();
        let select = &self.select;
        if !self.kind.selects() && (select.frames.is_some() || select.phase.is_some()) {
            return Err(WireError::Selection {
                on: on(),
                kind: self.kind.name(),
            });
        }
        if let Some(FrameCount::Nth(0) | FrameCount::Every(0)) =
            select.frames.as_ref().map(|frames| frames.count)
        {
            return Err(WireError::FrameNumber { on: on() });
        }
        match self.chance() {
            Some((what, value)) if !(0.0..=1.0).contains(&value) => Err(WireError::Probability {
                on: on(),
                what,
                value,
            }),
            _ => Ok(()),
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
        let select = &self.select;
        if let Some(direction) = select.direction {
            writeln!(f, "direction = {:?}", direction.name())?;
        }
        if let Some(phase) = select.phase {
            writeln!(f, "phase = {:?}", phase.name())?;
        }
        if let Some(frames) = &select.frames {
            writeln!(f, "on_frame = {frames}")?;
        }
        // A fault to the end of time has no length in a scenario.
        if self.until() == SimTime::MAX {
            return Ok(());
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
