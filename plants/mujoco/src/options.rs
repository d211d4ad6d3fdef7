//! What to simulate, and how MuJoCo is to go about it.

use twinrig_legged::{LeggedError, Setup};

use crate::engine::EngineError;

/// What the unknowns are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// Every segment is a body of its own, which pins hold to its neighbours: the thesis' third model, and the default.
    Maximal,
    /// Joint angles: nothing has to be held together.
    Minimal,
}

impl Coordinates {
    /// All of them, the default first.
    pub const ALL: [Self; 2] = [Self::Maximal, Self::Minimal];

    /// Its name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Maximal => "maximal",
            Self::Minimal => "minimal",
        }
    }
}

/// How time is integrated; MuJoCo's manual tells the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// Symplectic, of first order; friction of joints is implicit.
    Euler,
    /// Symplectic, of first order; all that damps is implicit.
    Implicit,
    /// The same without the derivatives of inertial forces.
    ImplicitFast,
    /// Springs, too, are implicit, and constraints know of it: stable at any stiffness, and damps what swings fast.
    Discrete,
    /// Of fourth order where nothing touches.
    Rk4,
}

impl Integrator {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::ImplicitFast,
        Self::Rk4,
        Self::Euler,
        Self::Implicit,
        Self::Discrete,
    ];

    /// Its name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Implicit => "implicit",
            Self::ImplicitFast => "implicitfast",
            Self::Discrete => "discrete",
            Self::Rk4 => "rk4",
        }
    }

    /// Its name in MJCF.
    pub(crate) const fn keyword(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Rk4 => "RK4",
            other => other.name(),
        }
    }
}

/// What finds the forces of constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Newton's method: few iterations, to the last digit.
    Newton,
    /// Conjugate gradients.
    Cg,
    /// Projected Gauss–Seidel, row by row.
    Pgs,
}

impl Solver {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Newton, Self::Cg, Self::Pgs];

    /// Its name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Newton => "newton",
            Self::Cg => "cg",
            Self::Pgs => "pgs",
        }
    }

    /// Its name in MJCF.
    pub(crate) const fn keyword(self) -> &'static str {
        match self {
            Self::Newton => "Newton",
            Self::Cg => "CG",
            Self::Pgs => "PGS",
        }
    }
}

/// The shape of the limit of friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cone {
    /// Coulomb's.
    Elliptic,
    /// A pyramid inside of it.
    Pyramidal,
}

impl Cone {
    /// Both, the default first.
    pub const ALL: [Self; 2] = [Self::Elliptic, Self::Pyramidal];

    /// Its name in scenarios and in MJCF.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Elliptic => "elliptic",
            Self::Pyramidal => "pyramidal",
        }
    }
}

/// How soon a constraint takes its error back: the time constant of MuJoCo's `solref`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Closing {
    /// So many of the plant's greatest steps. Two are as stiff as MuJoCo lets a constraint be.
    Steps(f64),
    /// So many seconds, whatever the step.
    Seconds(f64),
}

/// MuJoCo's own settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numerics {
    /// How time is integrated.
    pub integrator: Integrator,
    /// What finds the forces of constraints.
    pub solver: Solver,
    /// Iterations it may take in a step.
    pub iterations: u32,
    /// Improvement at which it stops, as MuJoCo scales it \[1\].
    pub tolerance: f64,
    /// The shape of the limit of friction.
    pub cone: Cone,
    /// How soon an error of a constraint is taken back.
    pub closing: Closing,
    /// Damping ratio of that \[1\].
    pub damping: f64,
    /// The same of the pins between segments, in maximal coordinates \[1\].
    pub pin_damping: f64,
    /// The same of feet on the ground. A foot comes into the ground by what it moves in a step; the more this is above one, the
    /// slower it is pushed out again, and the less it bounces \[1\].
    pub contact_damping: f64,
    /// Impedance of feet on the ground, as of `impedance` \[1\].
    pub contact_impedance: [f64; 2],
    /// Times that forces are found again in a step for feet that slide, at most: MuJoCo lifts these off the ground, and Coulomb's
    /// law does not. None leaves them as MuJoCo has them. Only for elliptic cones.
    pub sliding_rounds: u32,
    /// Impedance of a constraint, MuJoCo's d: the share of the wanted acceleration that it insists on, below 1 \[1\]. First
    /// where it is not violated, then where it is violated by `width`.
    pub impedance: [f64; 2],
    /// Violation at which the second impedance is reached \[m, rad\].
    pub width: f64,
    /// How much stiffer friction is than what presses the foot down \[1\].
    pub impratio: f64,
    /// Whether MuJoCo raises time constants below two steps to two steps, as is its default. Without it, a constraint that is
    /// stiffer than the step can resolve runs away.
    pub refsafe: bool,
}

impl Numerics {
    /// What measured best in these coordinates: see the table in the crate's documentation.
    pub const fn of(coordinates: Coordinates) -> Self {
        Self {
            integrator: match coordinates {
                Coordinates::Maximal => Integrator::Euler,
                Coordinates::Minimal => Integrator::Rk4,
            },
            solver: Solver::Newton,
            iterations: 100,
            tolerance: 1e-10,
            cone: Cone::Elliptic,
            closing: Closing::Steps(2.0),
            damping: 1.0,
            pin_damping: 0.7,
            contact_damping: 1.0,
            contact_impedance: [0.9999, 0.9999],
            sliding_rounds: 10,
            impedance: [0.999, 0.999],
            width: 1e-3,
            impratio: 1.0,
            refsafe: true,
        }
    }

    /// The same with the constraints as soft as MuJoCo has them where nothing is said.
    #[must_use]
    pub const fn with_soft_constraints(self) -> Self {
        Self {
            closing: Closing::Seconds(0.02),
            damping: 1.0,
            pin_damping: 1.0,
            contact_damping: 1.0,
            contact_impedance: [0.9, 0.95],
            sliding_rounds: 0,
            impedance: [0.9, 0.95],
            width: 1e-3,
            ..self
        }
    }
}

/// What to simulate of a robot, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What every plant of the robot is told.
    pub setup: Setup,
    /// What the unknowns are.
    pub coordinates: Coordinates,
    /// MuJoCo's own settings.
    pub numerics: Numerics,
}

impl Options {
    /// The default settings in these coordinates.
    pub fn new(setup: Setup, coordinates: Coordinates) -> Self {
        Self {
            setup,
            coordinates,
            numerics: Numerics::of(coordinates),
        }
    }
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MujocoError {
    /// Robot and setup do not fit together.
    #[error(transparent)]
    Legged(#[from] LeggedError),
    /// MuJoCo refuses the model, or is not there in the right version.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A setting that is none.
    #[error("{setting} cannot be {value}: {why}")]
    Setting {
        /// Its name in scenarios.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// What it has to be.
        why: &'static str,
    },
    /// Settings that do not go together.
    #[error("{0}")]
    Together(&'static str),
}

impl Numerics {
    /// Refuses what is no setting, and what does not go together.
    pub(crate) fn check(&self) -> Result<(), MujocoError> {
        let (closing, time) = match self.closing {
            Closing::Steps(steps) => ("solref_steps", steps),
            Closing::Seconds(seconds) => ("solref_time", seconds),
        };
        for (setting, value) in [
            (closing, time),
            ("solref_damping", self.damping),
            ("pin_damping", self.pin_damping),
            ("contact_damping", self.contact_damping),
            ("solver_tolerance", self.tolerance),
            ("impratio", self.impratio),
            ("solimp_width", self.width),
        ] {
            if !(value.is_finite() && value > 0.0) {
                let why = "it has to be positive";
                return Err(MujocoError::Setting {
                    setting,
                    value,
                    why,
                });
            }
        }
        let impedances = [
            ("solimp_min", self.impedance[0]),
            ("solimp_max", self.impedance[1]),
            ("contact_solimp_min", self.contact_impedance[0]),
            ("contact_solimp_max", self.contact_impedance[1]),
        ];
        for (setting, value) in impedances {
            if !(1e-4..=0.9999).contains(&value) {
                return Err(MujocoError::Setting {
                    setting,
                    value,
                    why: "it has to be from 0.0001 to 0.9999; MuJoCo would silently take the nearer of both",
                });
            }
        }
        if self.iterations == 0 {
            return Err(MujocoError::Setting {
                setting: "iterations",
                value: 0.0,
                why: "the solver needs one at least",
            });
        }
        if self.refsafe && matches!(self.closing, Closing::Steps(steps) if steps < 2.0) {
            return Err(MujocoError::Together(
                "`solref_steps` below 2 is what MuJoCo raises to 2: take 2, or set `refsafe = \"off\"`, with which constraints \
                 that stiff may run away",
            ));
        }
        Ok(())
    }
}
