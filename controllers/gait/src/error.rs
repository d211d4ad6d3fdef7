//! Errors of gaits.

use thiserror::Error;

/// Reason why a gait is invalid.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GaitError {
    /// A value is not finite.
    #[error("{what} is {value}, which is not a finite number")]
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A value is outside the domain of the formulas.
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
    /// An incidence angle near 0 or π, where the control point is at infinity.
    #[error(
        "{what} is {value} rad: tan(angle - pi/2) diverges towards 0 and pi, so it has to lie within {min} to {max} rad"
    )]
    FlatIncidence {
        /// `touch_down_angle` or `take_off_angle`.
        what: &'static str,
        /// Its value \[rad\].
        value: f64,
        /// Minimum \[rad\].
        min: f64,
        /// Maximum \[rad\].
        max: f64,
    },
    /// Unknown name of a gait.
    #[error("there is no gait `{name}`; there are {known}")]
    UnknownGait {
        /// The requested name.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// One load signal for several legs.
    #[error("`{name}` would be the load of every leg; write `*` in place of the name of the leg")]
    OneLoad {
        /// The name of the signal.
        name: String,
    },
    /// The geometry of a leg is impossible.
    #[error("leg `{name}`")]
    Leg {
        /// Name of the leg.
        name: String,
        /// Reason.
        source: twinrig_robot::leg::LegError,
    },
    /// A leg that has no joint of abduction should step to the side.
    #[error(
        "leg `{name}` has no joint of abduction and cannot step to the side: add `[leg.….abduction]` to the robot \
         file, or choose another `abduction`"
    )]
    NoAbduction {
        /// Name of the leg.
        name: String,
    },
    /// Unknown name of a leg.
    #[error("there is no leg `{name}`; the robot has {known}")]
    UnknownLeg {
        /// The requested name.
        name: String,
        /// The robot's legs, separated by commas.
        known: String,
    },
}
