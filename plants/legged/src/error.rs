//! What is wrong with a robot or a setup, whichever plant it is for.

use twinrig_actuator::{MotorError, ServoError};
use twinrig_leg::{LegError, Stop};

/// Why a plant of a legged robot cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LeggedError {
    /// The robot has no such leg.
    #[error("the robot {robot} has no leg {leg:?}; it has {known}")]
    NoSuchLeg {
        /// Name of the robot.
        robot: String,
        /// The leg asked for.
        leg: String,
        /// The legs it has.
        known: String,
    },
    /// Too many legs, or one of them twice.
    #[error("{0}")]
    Legs(String),
    /// A leg makes no pantograph, or cannot take its start.
    #[error("leg {leg}: {why}")]
    Leg {
        /// Name of the leg.
        leg: String,
        /// What is wrong.
        why: LegError,
    },
    /// A leg would start beyond one of its stops.
    #[error(
        "leg {leg}: the start is {by:.6} m beyond the stop {stop:?}; choose one between its stops"
    )]
    StartBeyondStop {
        /// Name of the leg.
        leg: String,
        /// The stop.
        stop: Stop,
        /// How far beyond \[m\].
        by: f64,
    },
    /// A leg would start with a joint bent the other way, which the lengths of rods and springs alone do not tell.
    #[error("leg {leg}: the start bends the {joint} the wrong way, by {angle:.4} rad")]
    StartBentBack {
        /// Name of the leg.
        leg: String,
        /// `knee` or `ankle`.
        joint: &'static str,
        /// Its angle, q2 or q3 \[rad\].
        angle: f64,
    },
    /// A servo makes no servo.
    #[error("{drive} servo: {why}")]
    Servo {
        /// `hip` or `knee`.
        drive: &'static str,
        /// What is wrong.
        why: ServoError,
    },
    /// A motor makes no motor.
    #[error("{drive} motor: {why}")]
    Motor {
        /// `hip` or `knee`.
        drive: &'static str,
        /// What is wrong.
        why: MotorError,
    },
    /// A mass or a moment of inertia that has to be positive is not.
    #[error("the {what} is {value} (SI units); it has to be positive")]
    Mass {
        /// Which mass.
        what: String,
        /// Its value.
        value: f64,
    },
    /// The integration step is zero.
    #[error("the step has to be longer than zero")]
    Step,
}

impl LeggedError {
    /// Wraps what is wrong with the leg of that name.
    pub fn of_leg(leg: &str) -> impl Fn(LegError) -> Self + '_ {
        move |why| Self::Leg {
            leg: leg.to_owned(),
            why,
        }
    }
}

/// Lets a mass \[kg\] or a moment of inertia \[kg·m²\] through if it is positive and finite.
///
/// # Errors
/// [`LeggedError::Mass`] with `what` in it.
pub fn positive(what: &str, value: f64) -> Result<(), LeggedError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(LeggedError::Mass {
            what: what.to_owned(),
            value,
        })
    }
}
