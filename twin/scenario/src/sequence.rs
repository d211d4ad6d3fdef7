//! Claims about the sequence of two conditions.

use twinrig_document::Placed;
use twinrig_kernel::{SimDuration, Unit};

use crate::limits::Limits;

/// A condition on an element of a signal: it holds where the element is within limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// Name of the signal.
    pub name: Placed<String>,
    /// Element of the signal.
    pub component: usize,
    /// Whether the magnitude of the element is compared.
    pub absolute: bool,
    /// Unit of the limits.
    pub unit: Unit,
    /// Limits.
    pub limits: Limits,
}

/// A claim about the sequence of two conditions: at each sample at which one holds, the other holds
/// at a sample of a time window.
///
/// In Signal Temporal Logic, with the window w and the duration T of the observation: a response is
/// G\[0, T − w\] (whenever → F\[0, w\] other), a precedence G\[w, T\] (whenever → O\[0, w\] other).
/// Samples whose window is not observed completely are not judged.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceClaim {
    /// Condition that requires the other one.
    pub whenever: Condition,
    /// The other condition.
    pub other: Condition,
    /// Time window of the other condition.
    pub relation: Relation,
}

/// Time window in which the other condition of a sequence holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// Response: at the same time or at most this long after.
    Then(SimDuration),
    /// Precedence: at the same time or at most this long before; none for any time since the start
    /// of the expectation's window.
    Before(Option<SimDuration>),
}
