//! Errors of scripts.

use thiserror::Error;

/// Reason why a script is invalid.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ScriptError {
    /// Unknown name of a leg.
    #[error("there is no leg `{name}`; the robot has {known}")]
    UnknownLeg {
        /// The requested name.
        name: String,
        /// The robot's legs, separated by commas.
        known: String,
    },
    /// Unknown name of a shape.
    #[error("there is no shape `{name}`; there are {known}")]
    UnknownShape {
        /// The requested name.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// Unknown name of a drive.
    #[error("there is no drive `{name}`; there are hip, knee")]
    UnknownDrive {
        /// The requested name.
        name: String,
    },
    /// The plant has no motors on free shafts.
    #[error("the plant has no motors on free shafts")]
    NoMotors,
    /// A value is outside its valid range.
    #[error("{what} is {value}, outside {min} to {max}")]
    OutOfRange {
        /// Name of the quantity.
        what: &'static str,
        /// Its value, in SI units.
        value: f64,
        /// Minimum.
        min: f64,
        /// Maximum.
        max: f64,
    },
}
