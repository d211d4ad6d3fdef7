//! What to simulate, and how.

use twinrig_legged::{LeggedError, Setup};

/// How time is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Method {
    /// The classical Runge–Kutta method of fourth order between events that are found to the instant; the default.
    Rk4,
    /// Rosenbrock's method of fourth order, L-stable and adaptive: for stiff robots and for references.
    Rodas4,
    /// Moreau's midpoint rule: constraints at velocity level, no events; for gaits that rattle.
    Moreau,
    /// Symplectic Euler with constraints at velocity level.
    SemiImplicit,
    /// Explicit Euler, for comparison.
    ExplicitEuler,
    /// As the thesis has it, signs corrected: explicit Euler, constraints at acceleration level, rates set to zero at stops.
    /// For comparison: it makes energy.
    Thesis,
}

impl Method {
    /// All of them, the default first.
    pub const ALL: [Self; 6] = [
        Self::Rk4,
        Self::Rodas4,
        Self::Moreau,
        Self::SemiImplicit,
        Self::ExplicitEuler,
        Self::Thesis,
    ];

    /// Its name in scenarios.
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

/// What to simulate of a robot, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What every plant of the robot is told.
    pub setup: Setup,
    /// How time is integrated.
    pub method: Method,
    /// Error that a step of [`Method::Rk4`] or [`Method::Rodas4`] may make in the place of a foot or the trunk, by its own
    /// estimate: at its end, and by its velocities within the time constant of a pendulum as long as a leg. What makes more is
    /// taken in shorter steps \[m\]. Infinite: none is.
    pub tolerance: f64,
    /// Whether the foot is a segment of its own where the robot has a toe joint; a point at the end of the third segment
    /// otherwise.
    pub toe: bool,
}

impl Options {
    /// A tolerance that keeps a foot right to 1e-6 m over 0.3 s at 2 ms, however hard it hits, and to 1e-5 m with springs a
    /// hundred times as stiff \[m\].
    pub const TOLERANCE: f64 = 3e-7;
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LcpError {
    /// Robot and setup do not fit together.
    #[error(transparent)]
    Legged(#[from] LeggedError),
    /// Some legs have a toe joint and some have none.
    #[error("leg {leg} has no toe joint and others have; simulate them without (`toe = false`)")]
    Toe {
        /// The leg without.
        leg: String,
    },
    /// A method that has no motors.
    #[error(
        "the method `thesis` has no motors: it sets the rate of a joint whose stop is reached to zero and lets its drive turn on; \
         choose servos, or another method"
    )]
    Motors,
    /// A tolerance that is no tolerance.
    #[error("the tolerance is {0} m; it has to be positive")]
    Tolerance(f64),
    /// The start cannot be taken.
    #[error("the start cannot be taken: {0}")]
    Start(String),
}
