use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};

/// Something that goes wrong on a wire for a while. Plain data; prints itself as a `[[fault]]` table of a scenario.
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
/// byte is complete within the fault's time. The others hit single bytes that are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// A burst is lost.
    Drop {
        /// How probable that is, from 0 to 1.
        probability: f64,
    },
    /// Bits are turned round.
    Flip {
        /// How probable that is for each bit, from 0 to 1.
        rate: f64,
    },
    /// A burst comes later.
    Delay {
        /// By how much.
        by: SimDuration,
    },
    /// A burst comes twice.
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
    /// Somebody talks without being asked: bursts of 1 to 64 random bytes. What he talks over is lost. A node
    /// that babbles is heard by the others; it hears itself no more than else.
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
    /// Seed; each place has streams of its own.
    pub seed: u64,
}
