use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

/// Kind of a fault of a wire, or of the boards on it. A *burst* is a sequence of bytes with pauses
/// of at most one byte time; a fault affects a burst as a whole if its first byte is complete while
/// the fault is active. Flip, unplug, stuck and babble affect single bytes.
///
/// Faults at one place combine: a burst dropped by any of them is lost, delays add up, and so on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// A burst is lost.
    Drop {
        /// Probability, from 0 to 1.
        probability: f64,
    },
    /// Bits are flipped, of the ten of a byte including start and stop bit. A byte with a wrong
    /// start bit is lost; a wrong stop bit is a framing error.
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
    /// The supply of boards fails for the length of the fault. They release their motors, neither
    /// receive nor transmit, and then boot: registers have their values at power-on, the stored
    /// ones where they are non-volatile.
    BrownOut {
        /// Time to boot; none for that of the board.
        boot: Option<SimDuration>,
    },
    /// The clocks of boards run at another rate.
    Drift {
        /// Change of the rate \[ppb\].
        rate_ppb: i64,
    },
}

impl FaultKind {
    /// Returns whether the fault acts on boards instead of bytes: of a whole bus, on all of them.
    pub const fn acts_on_boards(&self) -> bool {
        matches!(self, Self::BrownOut { .. } | Self::Drift { .. })
    }

    /// Returns whether the fault acts on bytes that pass, so that it may select a phase and frames.
    pub const fn selects(&self) -> bool {
        !self.acts_on_boards()
            && !matches!(
                self,
                Self::Unplug { fails: true } | Self::Stuck | Self::Babble { .. }
            )
    }

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
            Self::BrownOut { .. } => "brown-out",
            Self::Drift { .. } => "drift",
        }
    }
}
