//! Failures of the worker of an FMU.

use thiserror::Error;
use twinrig::kernel::SimDuration;

/// Remedy for an FMU that ends the simulation.
const TERMINATION_HELP: &str = "if that is its regular end, set `may_terminate = true` in [plant]; expectations are then judged up to it";

/// Failure of a request to a worker.
#[derive(Clone, Debug, Error)]
pub(super) enum Failure {
    /// The FMU cannot be used.
    #[error("{0}")]
    Refused(String),
    /// A call of the FMU failed.
    #[error("`{part}`: {why}")]
    Failed {
        /// Function or variable.
        part: String,
        /// Reason, with the last messages of the FMU.
        why: String,
    },
    /// The FMU ended the simulation.
    #[error("`{part}`: {why}: {}", TERMINATION_HELP)]
    Terminated {
        /// Function.
        part: String,
        /// How, with the last messages of the FMU.
        why: String,
    },
    /// The process of the FMU ended.
    #[error("its process {how}{output}")]
    Ended {
        /// Signal or exit code.
        how: String,
        /// Last output of the FMU, as the end of the sentence.
        output: String,
    },
    /// A call did not return.
    #[error("a call took longer than {limit} (`time_limit`){output}")]
    Late {
        /// The limit.
        limit: SimDuration,
        /// Last output of the FMU, as the end of the sentence.
        output: String,
    },
    /// A request to end the work arrived while a call was awaited.
    #[error("interrupted")]
    Interrupted,
    /// The worker could not be started or reached.
    #[error("its worker {0}")]
    Worker(String),
}

impl Failure {
    /// Returns the failure of a request that the system refused.
    pub fn io(problem: &str, error: &std::io::Error) -> Self {
        Self::Worker(format!("{problem}: {error}"))
    }

    /// Returns the part of the FMU that failed, if it is known.
    pub fn part(&self) -> Option<&str> {
        match self {
            Self::Failed { part, .. } | Self::Terminated { part, .. } => Some(part),
            _ => None,
        }
    }

    /// Returns the reason without the part.
    pub fn why(&self) -> String {
        match self {
            Self::Failed { why, .. } => why.clone(),
            Self::Terminated { why, .. } => format!("{why}: {TERMINATION_HELP}"),
            other => other.to_string(),
        }
    }
}
