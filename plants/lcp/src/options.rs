//! Options of the plant.

use twinrig_compliant::lanes::Features;
use twinrig_legged::{Constraints, LeggedError, Setup};

/// Time integration method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Method {
    /// Classical fourth-order Runge–Kutta method between located events; the default.
    Rk4,
    /// Fourth-order Rosenbrock method, L-stable and adaptive: for stiff robots and reference
    /// solutions.
    Rodas4,
    /// Moreau's midpoint rule: constraints at velocity level, no events; for gaits with chattering
    /// contacts.
    Moreau,
    /// Symplectic Euler with constraints at velocity level.
    SemiImplicit,
    /// Explicit Euler, for comparison.
    ExplicitEuler,
    /// Scheme of the thesis with corrected signs: explicit Euler, constraints at acceleration
    /// level, rates set to zero at stops. For comparison: it creates energy.
    Thesis,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 6] = [
        Self::Rk4,
        Self::Rodas4,
        Self::Moreau,
        Self::SemiImplicit,
        Self::ExplicitEuler,
        Self::Thesis,
    ];

    /// Returns whether steps end at events, with a set of active constraints between them.
    pub(crate) const fn is_event_driven(self) -> bool {
        matches!(self, Self::Rk4 | Self::Rodas4)
    }

    /// Returns the name used in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rk4 => "rk4",
            Self::Rodas4 => "rodas4",
            Self::Moreau => "moreau",
            Self::SemiImplicit => "semi-implicit",
            Self::ExplicitEuler => "explicit-euler",
            Self::Thesis => "thesis",
        }
    }
}

/// Options of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Setup common to all plants of the robot.
    pub setup: Setup,
    /// Formulation of the constraints.
    pub constraints: Constraints,
    /// Time integration method.
    pub method: Method,
    /// Maximum estimated error in the position of a foot or the trunk \[m\]; infinite disables the
    /// control. With rigid constraints of a step of [`Method::Rk4`] or [`Method::Rodas4`], at its
    /// end and by its velocities over the time constant of a pendulum of leg length; longer steps
    /// are divided. With compliant constraints per millisecond.
    pub tolerance: f64,
    /// Whether the foot is a separate segment where the robot has a toe joint; otherwise it is a
    /// point at the end of the third segment.
    pub toe: bool,
    /// Registers for compliant constraints; results do not depend on them.
    pub features: Features,
}

impl Options {
    /// Tolerance that keeps the error of a foot below 1e-6 m over 0.3 s at steps of 2 ms, also with
    /// hard impacts, and below 1e-5 m with springs a hundred times as stiff \[m\].
    pub const TOLERANCE: f64 = 3e-7;

    /// Default tolerance of compliant constraints \[m\].
    pub const COMPLIANT_TOLERANCE: f64 = twinrig_compliant::StepControl::TOLERANCE;
}

/// Errors in building a plant.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LcpError {
    /// Robot and setup do not match.
    #[error(transparent)]
    Legged(#[from] LeggedError),
    /// Some legs have a toe joint and others have none.
    #[error("leg {leg} has no toe joint but others have one; simulate all without (`toe = false`)")]
    Toe {
        /// The leg without toe joint.
        leg: String,
    },
    /// The method does not support compliant constraints.
    #[error(
        "compliant constraints are integrated by `rk4`, not by `{0}`; remove the integrator, or choose `constraints = \"rigid\"`"
    )]
    CompliantMethod(&'static str),
    /// The method does not support motors.
    #[error(
        "the method `thesis` does not support motors, nor serial servos: it sets the rate of a joint at \
         a reached stop to zero while the drive keeps turning; choose `kind = \"servo\"` or another \
         method"
    )]
    Motors,
    /// The tolerance is not positive.
    #[error("the tolerance is {0} m; it has to be positive")]
    Tolerance(f64),
    /// The start state is invalid.
    #[error("invalid start state: {0}")]
    Start(String),
}
