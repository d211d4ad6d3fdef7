//! Errors of robot files.

use thiserror::Error;
use twinrig_document::DocumentError;

/// Reason why a robot could not be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum RobotError {
    /// No robot file has that name.
    #[error("there is no robot `{name}`: {help}")]
    NotFound {
        /// The requested name or path.
        name: String,
        /// The nearest name, or all known names.
        help: String,
    },
    /// The file cannot be read, or its content is invalid.
    #[error(transparent)]
    Document(#[from] DocumentError),
}
