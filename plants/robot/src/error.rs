//! Why there is no robot.

use thiserror::Error;
use twinrig_document::DocumentError;

/// Why a robot could not be had.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum RobotError {
    /// No robot file has that name.
    #[error("there is no robot `{name}`: {help}")]
    NotFound {
        /// The name or path that was asked for.
        name: String,
        /// The nearest name, or all names there are.
        help: String,
    },
    /// The file cannot be read, or what it says is no robot.
    #[error(transparent)]
    Document(#[from] DocumentError),
}
