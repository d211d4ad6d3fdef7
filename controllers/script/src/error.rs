//! The errors of this crate.

use thiserror::Error;

/// What can be wrong with a script.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ScriptError {
    /// A leg is asked for that the robot does not have.
    #[error("there is no leg `{name}`; the robot has {known}")]
    UnknownLeg {
        /// The name asked for.
        name: String,
        /// The robot's legs, separated by commas.
        known: String,
    },
    /// A shape is asked for by a name that none has.
    #[error("there is no shape `{name}`; there are {known}")]
    UnknownShape {
        /// The name asked for.
        name: String,
        /// The names there are, separated by commas.
        known: String,
    },
    /// A shape is given for a drive that no leg has.
    #[error("there is no drive `{name}`; there are hip, knee")]
    UnknownDrive {
        /// The name of the drive.
        name: String,
    },
    /// A number lies outside the range in which it means something.
    #[error("{what} is {value}, outside {min} to {max}")]
    OutOfRange {
        /// The name of the quantity.
        what: &'static str,
        /// What it was, in SI units.
        value: f64,
        /// The least value that is allowed.
        min: f64,
        /// The greatest value that is allowed.
        max: f64,
    },
}
