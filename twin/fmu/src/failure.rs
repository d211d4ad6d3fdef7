//! Reasons for which a call of the master fails.

use thiserror::Error;
use twinrig_rig::fmu::FmuError;

use crate::phase::Phase;

/// Status of a call: the numbers of both versions.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The call has done its work.
    Ok = 0,
    /// The call has no result, or a value is refused.
    Discard = 2,
    /// The call is refused, or has failed.
    Error = 3,
    /// The instance can only be freed.
    Fatal = 4,
}

/// A call that fails.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// A call that the state of the instance does not permit.
    #[error("it is not allowed {phase}")]
    Phase { phase: Phase },
    /// A null pointer where a value is needed.
    #[error("`{argument}` is a null pointer")]
    Null { argument: &'static str },
    /// A pointer to values at an address that no such value has.
    #[error("`{argument}` is not aligned to {alignment} bytes")]
    Alignment {
        argument: &'static str,
        alignment: usize,
    },
    /// A text that is not UTF-8.
    #[error("`{argument}` is not UTF-8")]
    Text { argument: &'static str },
    /// An array that is longer than memory.
    #[error("`{argument}` has {length} elements, more than memory has")]
    Length {
        argument: &'static str,
        length: usize,
    },
    /// A buffer that is too short.
    #[error("the state has {needed} bytes, and the buffer only {given}")]
    Buffer { needed: usize, given: usize },
    /// A function that this FMU does not support.
    #[error("this FMU does not support it: {why}")]
    Unsupported { why: &'static str },
    /// An error of the instance.
    #[error(transparent)]
    Fmu(#[from] FmuError),
}

impl Failure {
    /// Returns the status of the call.
    pub(crate) fn status(&self) -> Status {
        match self {
            Self::Fmu(error) if error.is_fatal() => Status::Fatal,
            Self::Fmu(FmuError::NotFinite { .. } | FmuError::OutOfRange(_)) => Status::Discard,
            _ => Status::Error,
        }
    }
}
