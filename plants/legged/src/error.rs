//! Errors of robots and setups common to all plants.

use twinrig_actuator::{MotorError, ServoError};
use twinrig_robot::leg::{LegError, Stop};

/// Invalid robot or setup of a plant.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LeggedError {
    /// The robot has no such leg.
    #[error("the robot {robot} has no leg {leg:?}; it has {known}")]
    NoSuchLeg {
        /// Name of the robot.
        robot: String,
        /// Name of the requested leg.
        leg: String,
        /// Names of its legs.
        known: String,
    },
    /// Too many legs, or a duplicate leg.
    #[error("{0}")]
    Legs(String),
    /// A leg has invalid parameters or cannot reach its start.
    #[error("leg {leg}: {why}")]
    Leg {
        /// Name of the leg.
        leg: String,
        /// Cause.
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
        /// Distance beyond the stop \[m\].
        by: f64,
    },
    /// A leg would start with a joint bent to the wrong side, which lengths of rods and springs
    /// alone do not reveal.
    #[error("leg {leg}: the start bends the {joint} the wrong way, by {angle:.4} rad")]
    StartBentWrongSide {
        /// Name of the leg.
        leg: String,
        /// `knee` or `ankle`.
        joint: &'static str,
        /// Its angle, q2 or q3 \[rad\].
        angle: f64,
    },
    /// Invalid servo parameters.
    #[error("{drive} servo: {why}")]
    Servo {
        /// `hip`, `knee` or `abduction`.
        drive: &'static str,
        /// Cause.
        why: ServoError,
    },
    /// A leg has no joint of abduction.
    #[error(
        "leg {leg} has no joint of abduction: add `[leg.….abduction]` to the robot file, or choose \
         `abduction = \"locked\"`"
    )]
    NoAbduction {
        /// Name of the leg.
        leg: String,
    },
    /// The plant locks the joints of abduction.
    #[error(
        "{plant} has no joints of abduction: choose `abduction = \"locked\"`, or a plant that has them: \
         `massless` or `lcp` with compliant constraints and without a toe joint, `mujoco`, or `rapier` \
         with impulse joints"
    )]
    AbductionLocked {
        /// The plant.
        plant: &'static str,
    },
    /// The contact of trunk, knees and ankles is not known.
    #[error(
        "the robot {robot} has no contact but that of its feet: add `[contact]` to the robot file, or choose \
         `contacts = \"feet\"`"
    )]
    NoContact {
        /// Name of the robot.
        robot: String,
    },
    /// Only the feet have contact in the plant.
    #[error(
        "{plant} has contact at the feet only: choose `contacts = \"feet\"`, or `model = \"lcp\"` with \
         compliant constraints and without a toe joint"
    )]
    FeetOnly {
        /// The plant.
        plant: &'static str,
    },
    /// Knees and ankles have no contact in the plant.
    #[error(
        "{plant} has no contact at knees and ankles: choose `contacts = \"trunk\"`, or `model = \"lcp\"`"
    )]
    WithoutSegments {
        /// The plant.
        plant: &'static str,
    },
    /// Invalid motor parameters.
    #[error("{drive} motor: {why}")]
    Motor {
        /// `hip` or `knee`.
        drive: &'static str,
        /// Cause.
        why: MotorError,
    },
    /// The compliance of a leg is not known.
    #[error(
        "leg {leg} has no compliance: add `[leg.….compliance]` to the robot file, or choose \
         `constraints = \"rigid\"`"
    )]
    Compliance {
        /// Name of the leg.
        leg: String,
    },
    /// Compliant ground contact has no coefficient of restitution.
    #[error(
        "the ground has a restitution of {restitution}, which compliant constraints do not have: \
         how far a foot bounces follows from stiffness and damping of its sole; take \
         `restitution = 0`, or `constraints = \"rigid\"`"
    )]
    Restitution {
        /// The coefficient.
        restitution: f64,
    },
    /// A mass or a moment of inertia is not positive and finite.
    #[error("the {what} is {value} (SI units); it must be positive")]
    Mass {
        /// Name of the mass or moment.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A push that the plant cannot have.
    #[error("push {push:?}: {why}")]
    Push {
        /// Name of the push.
        push: String,
        /// Cause.
        why: PushProblem,
    },
    /// The integration step is zero.
    #[error("the step must be longer than zero")]
    Step,
}

/// Cause for which a push is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PushProblem {
    /// The trunk cannot move.
    #[error("the trunk is fixed; push a foot, or let the trunk move")]
    FixedTrunk,
    /// The leg is not simulated.
    #[error("there is no leg {0:?} in the scene; push a simulated leg")]
    NoSuchLeg(String),
    /// It takes no time, or ends beyond the greatest time.
    #[error("its duration is zero or too long; give the time for which it acts")]
    Duration,
    /// Force or place is infinite or NaN.
    #[error("its force or place is not finite")]
    NotFinite,
}

impl LeggedError {
    /// Returns a function that wraps an error of the named leg.
    pub fn of_leg(leg: &str) -> impl Fn(LegError) -> Self + '_ {
        move |why| Self::Leg {
            leg: leg.to_owned(),
            why,
        }
    }
}

/// Checks that a mass \[kg\] or a moment of inertia \[kg·m²\] is positive and finite.
///
/// # Errors
/// [`LeggedError::Mass`] that names `what`.
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
