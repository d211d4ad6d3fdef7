//! The errors of this crate.

use thiserror::Error;

/// What can be wrong with a gait.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GaitError {
    /// A number that has to be finite is not.
    #[error("{what} is {value}, which is not a finite number")]
    NotFinite {
        /// The name of the quantity.
        what: &'static str,
        /// What it was.
        value: f64,
    },
    /// A number lies outside the range in which the formulas mean something.
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
    /// An incidence angle so flat that its control point runs off to infinity.
    #[error(
        "{what} is {value} rad: tan(angle - pi/2) diverges towards 0 and pi, so it has to lie within {min} to {max} rad"
    )]
    FlatIncidence {
        /// `touch_down_angle` or `take_off_angle`.
        what: &'static str,
        /// What it was \[rad\].
        value: f64,
        /// The least angle \[rad\].
        min: f64,
        /// The greatest angle \[rad\].
        max: f64,
    },
    /// A gait table is asked for by a name it does not have.
    #[error("there is no gait `{name}`; there are {known}")]
    UnknownGait {
        /// The name asked for.
        name: String,
        /// The names there are, separated by commas.
        known: String,
    },
    /// The geometry of a leg is impossible.
    #[error("leg `{name}`")]
    Leg {
        /// Name of the leg.
        name: String,
        /// What is wrong with it.
        source: twinrig_leg::LegError,
    },
    /// A leg is asked for that the robot does not have.
    #[error("there is no leg `{name}`; the robot has {known}")]
    UnknownLeg {
        /// The name asked for.
        name: String,
        /// The robot's legs, separated by commas.
        known: String,
    },
}
