//! Errors, faults and warnings of the engine.

/// Reason why an engine cannot be built, or a state not restored.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EngineError {
    /// The library has another version than the required one.
    #[error("MuJoCo {wanted} is required, but {found} was found; `ci/setup mujoco` installs it")]
    Version {
        /// Required version.
        wanted: &'static str,
        /// Version of the library.
        found: String,
    },
    /// MuJoCo refuses the model.
    #[error("MuJoCo refuses the model: {0}")]
    Model(String),
    /// A state belongs to another model.
    #[error("the state has {found} values, but states of this model have {expected}")]
    State {
        /// Values in a state of this model.
        expected: usize,
        /// Values in the state to restore.
        found: usize,
    },
}

/// Reason why a step failed. The state is that before the step.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EngineFault {
    /// A value is NaN or exceeds MuJoCo's limit.
    #[error("the {what} of {of} is NaN or exceeds 1e10; take a shorter step")]
    Diverged {
        /// `acceleration`, `velocity`, `position` or `control`.
        what: &'static str,
        /// Name of the joint or actuator.
        of: String,
    },
    /// A warning of MuJoCo.
    #[error("MuJoCo warns: {0}")]
    EngineWarning(EngineWarning),
}

/// Warnings of MuJoCo other than of diverged values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum EngineWarning {
    /// The inertia matrix is close to singular.
    #[error("the inertia matrix is (close to) singular")]
    Inertia,
    /// The memory for contacts is exhausted.
    #[error("no memory for more contacts; raise `memory` in the model's <size>")]
    Contacts,
    /// The memory for constraints is exhausted.
    #[error("no memory for more constraints; raise `memory` in the model's <size>")]
    Constraints,
}

impl EngineWarning {
    /// All warnings in the order of MuJoCo's indices, of which these are the first.
    pub(super) const ALL: [Self; 3] = [Self::Inertia, Self::Contacts, Self::Constraints];
}
