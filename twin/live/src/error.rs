use thiserror::Error;
use twinrig_kernel::SimTime;
use twinrig_rig::Error as RigError;

/// Failure of an act on a session. The run is unchanged.
#[derive(Debug, Error)]
pub enum LiveError {
    /// The controller has no such variable.
    #[error("there is no process variable `{name}`{}", nearest(near))]
    NoSuchVariable {
        /// The requested name.
        name: String,
        /// Similar names.
        near: Vec<String>,
    },
    /// The controller would refuse the value.
    #[error("{0}")]
    Refused(String),
    /// The state of a part cannot be saved.
    #[error("this run has no past: {0}")]
    NoPast(String),
    /// The time is after the end of the scenario.
    #[error("{at} is after the end of the scenario, {end}")]
    PastEnd {
        /// The requested time.
        at: SimTime,
        /// End of the scenario.
        end: SimTime,
    },
    /// There is no branch of this number.
    #[error("there is no branch {branch}, only {count}, from 0")]
    NoSuchBranch {
        /// The requested number.
        branch: usize,
        /// Number of branches.
        count: usize,
    },
    /// The scenario of a branch does not have its changes, or cannot be built.
    #[error("the branch cannot be written as a scenario: {0}")]
    Branch(String),
    /// The rig cannot be built.
    #[error(transparent)]
    Rig(#[from] Box<RigError>),
}

impl From<RigError> for LiveError {
    fn from(error: RigError) -> Self {
        Self::Rig(Box::new(error))
    }
}

fn nearest(near: &[String]) -> String {
    match near {
        [] => String::new(),
        near => format!("; similar: {}", near.join(", ")),
    }
}
