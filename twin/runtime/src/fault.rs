use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

/// A fault of a wire. A *burst* is a sequence of bytes without a pause longer than a byte time; it is
/// affected as a whole if its first byte is complete within the time of the fault. Flip, unplug,
/// stuck and babble affect single bytes.
///
/// Faults at one place combine: a burst that any of them drops is lost, delays are added.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// A burst is lost.
    Drop {
        /// Probability, 0 to 1.
        probability: f64,
    },
    /// Bits are inverted: any of the ten bits of a byte, start and stop bits included. A byte with a
    /// wrong start bit is lost; one with a wrong stop bit has a framing error.
    Flip {
        /// Probability per bit, 0 to 1.
        rate: f64,
    },
    /// A burst is delayed, and with it the bursts behind it.
    Delay {
        /// Delay.
        by: SimDuration,
    },
    /// A burst is repeated, two byte times after its end.
    Duplicate {
        /// Probability, 0 to 1.
        probability: f64,
    },
    /// A burst is exchanged with the next one; without a next one it arrives when the fault ends.
    Reorder {
        /// Probability, 0 to 1.
        probability: f64,
    },
    /// No byte passes.
    Unplug {
        /// Whether the host detects it, which ends the run: a converter that is unplugged, not a bus.
        /// Only where the whole line is unplugged.
        fails: bool,
    },
    /// The line is held low: both sides receive 0x00 continuously, and nothing else.
    Stuck,
    /// Unsolicited bursts of 1 to 64 random bytes, which destroy bytes that they overlap. On a whole
    /// line both sides receive them; from a node the other nodes do, and the node receives bytes in
    /// its pauses.
    Babble {
        /// Pauses between bursts are uniform up to twice this; 0: no pauses.
        pause: SimDuration,
    },
}

impl FaultKind {
    /// Its name in a scenario file.
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
