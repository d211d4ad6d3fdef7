use thiserror::Error;
use twinrig_kernel::SimTime;

/// A law that does not hold.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{law} is violated at {at}: {what}")]
pub struct Violation {
    /// Name of the law: that of its function.
    pub law: &'static str,
    /// Instant at which it is seen.
    pub at: SimTime,
    /// What was found, with the values.
    pub what: String,
}

impl Violation {
    pub(super) fn new(law: &'static str, at: SimTime, what: impl Into<String>) -> Self {
        let what = what.into();
        Self { law, at, what }
    }
}
