use std::fmt;

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

/// Part of the traffic that a fault harms in its window of time: by default all of it. The parts
/// are combined: bytes of this direction, in this phase, of these frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FaultSelection {
    /// Direction; none for both.
    pub direction: Option<FaultDirection>,
    /// Phase of the driver; none for all.
    pub phase: Option<DriverPhase>,
    /// Frames; none for all bytes, framed or not.
    pub frames: Option<FrameChoice>,
}

/// Direction of bytes on a wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultDirection {
    /// From the host to the boards; at one board, the bytes that it receives.
    Out,
    /// From the boards to the host; at one board, the bytes that it transmits.
    In,
}

impl FaultDirection {
    /// Returns the name in a scenario.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Out => "out",
            Self::In => "in",
        }
    }
}

/// Phase of a driver, from the call that begins it to the next one. A run in virtual time ends
/// without closing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DriverPhase {
    /// From [`crate::Driver::open`] on.
    Opening,
    /// From the first [`crate::Driver::begin`] on.
    Transfer,
}

impl DriverPhase {
    /// Returns the name in a scenario.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Opening => "opening",
            Self::Transfer => "transfer",
        }
    }
}

/// Start of the transfers of a driver, from which its phase at any instant follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PhaseClock {
    transfers_from: Option<SimTime>,
}

impl PhaseClock {
    /// Records that a phase begins; the first beginning of the transfers counts.
    pub fn begin(&mut self, now: SimTime, phase: DriverPhase) {
        if phase == DriverPhase::Transfer {
            self.transfers_from.get_or_insert(now);
        }
    }

    /// Returns the phase at `now`. An instant at which the phase changes belongs to the earlier
    /// one: bytes that are complete then were transmitted before.
    pub fn at(&self, now: SimTime) -> DriverPhase {
        match self.transfers_from {
            Some(from) if from < now => DriverPhase::Transfer,
            _ => DriverPhase::Opening,
        }
    }
}

/// Frames that a fault harms, in one direction at its place. Those that begin in its window and
/// its phase are counted, and each direction counts its own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameChoice {
    /// Kind of a message of the host: only frames behind such a message are counted, up to its next
    /// message of another kind. None for all frames.
    pub after: Option<String>,
    /// Choice among the counted frames.
    pub count: FrameCount,
}

/// The value of `on_frame` in a scenario.
impl fmt::Display for FrameChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let after = self.after.as_ref().map(|kind| format!("after = {kind:?}"));
        let count = match self.count {
            FrameCount::All => None,
            FrameCount::Nth(nth) => Some(format!("nth = {nth}")),
            FrameCount::Every(every) => Some(format!("every = {every}")),
        };
        let parts: Vec<String> = after.into_iter().chain(count).collect();
        write!(f, "{{ {} }}", parts.join(", "))
    }
}

/// Choice of frames by their number, from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FrameCount {
    /// Every frame.
    #[default]
    All,
    /// One frame.
    Nth(u64),
    /// Each frame whose number is a multiple of this one.
    Every(u64),
}

impl FrameCount {
    /// Returns whether the frame of this number, from 1, is chosen.
    pub fn includes(self, number: u64) -> bool {
        match self {
            Self::All => true,
            Self::Nth(nth) => number == nth,
            Self::Every(period) => number.is_multiple_of(period),
        }
    }
}

/// Number of times that a fault took effect at one place, for reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultEffect {
    /// Number of the fault in the schedule of its bus, from 0.
    pub fault: usize,
    /// Number of bursts, or bytes where it harms single ones, that were harmed.
    pub harmed: u64,
}
