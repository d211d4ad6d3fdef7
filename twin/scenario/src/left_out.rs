//! A part that a scene omits.

use serde::Serialize;

/// An omitted part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Name of the part.
    pub part: String,
    /// Reason for which it is not required.
    pub why: String,
}
