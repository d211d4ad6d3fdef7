use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{BoardClock, SimDuration, SimTime};
use twinrig_runtime::{FaultKind, FaultSelection, FrameCount};

use crate::WireError;

/// Temporary fault of a transport. Plain data; its `Display` is a `[[fault]]` table of a scenario.
///
/// ```
/// use twinrig_kernel::{BoardClock, SimDuration, SimTime};
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

impl FaultSchedule {
    /// Whether faults harm the bytes on the line at a place.
    pub fn harms(&self, place: &str) -> bool {
        self.faults.iter().any(|fault| fault.harms(place))
    }

    /// Whether faults harm the bytes at the stub of the board at a place, or its supply: it is to
    /// be a [`crate::FaultyNode`].
    pub fn harms_board(&self, place: &str) -> bool {
        let fails = |fault: &Fault| {
            fault.strikes(place) && matches!(fault.kind, FaultKind::BrownOut { .. })
        };
        let mut faults = self.faults.iter();
        faults.any(|fault| fault.harms(place) || fails(fault))
    }

    /// Returns the clock of the board at a place with its faults.
    ///
    /// # Errors
    /// [`WireError::Drifts`] if there are two of them, [`WireError::Drift`] if its rate is then out
    /// of range.
    pub fn clock(&self, place: &str, clock: BoardClock) -> Result<BoardClock, WireError> {
        let mut struck = clock;
        let mut any = false;
        for fault in self.faults.iter().filter(|fault| fault.strikes(place)) {
            let FaultKind::Drift { rate_ppb } = fault.kind else {
                continue;
            };
            fault.check()?;
            let on = || place.to_owned();
            if any {
                return Err(WireError::Drifts { on: on() });
            }
            any = true;
            struck = clock
                .with_drift(fault.at, fault.until(), rate_ppb)
                .map_err(|source| WireError::Drift { on: on(), source })?;
        }
        Ok(struck)
    }
}

impl Fault {
    /// End time.
    pub fn until(&self) -> SimTime {
        let end = self.at.checked_add(self.lasts);
        end.unwrap_or(SimTime::MAX)
    }

    /// Whether the fault harms the bytes at a place.
    fn harms(&self, place: &str) -> bool {
        self.on == place && !self.kind.acts_on_boards()
    }

    /// Whether the fault acts on the board at a place: on it alone, or on all boards of its bus.
    pub(crate) fn strikes(&self, place: &str) -> bool {
        let rest = place.strip_prefix(self.on.as_str());
        let is_here = rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
        is_here && self.kind.acts_on_boards()
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
        let select = &self.select;
        let (on, kind) = (self.on.clone(), self.kind.name());
        if self.kind.acts_on_boards() && select.direction.is_some() {
            return Err(WireError::Direction { on, kind });
        }
        if !self.kind.selects() && (select.frames.is_some() || select.phase.is_some()) {
            return Err(WireError::Selection { on, kind });
        }
        if let Some(FrameCount::Nth(0) | FrameCount::Every(0)) =
            select.frames.as_ref().map(|frames| frames.count)
        {
            return Err(WireError::FrameNumber { on });
        }
        match self.chance() {
            Some((what, value)) if !(0.0..=1.0).contains(&value) => {
                Err(WireError::Probability { on, what, value })
            }
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
            FaultKind::BrownOut { boot: Some(boot) } => {
                writeln!(f, "boot = {}", Quantity(boot.as_nanos()))?;
            }
            FaultKind::Drift { rate_ppb } => {
                writeln!(f, "clock = \"{} ppm\"", *rate_ppb as f64 * 1e-3)?;
            }
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
