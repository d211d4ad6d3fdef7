use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;

use crate::request::Span;

/// Pending answer of a servo that is not the first one to answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Turn {
    pub(super) span: Span,
    pub(super) after: After,
    /// Time after which this servo no longer waits.
    pub(super) until: SimTime,
}

/// What precedes the answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum After {
    /// The answer of this servo.
    Answer(u8),
    /// So many bytes of the common answer, which has this length in all.
    Bytes(usize, usize),
}
