//! Options: what to simulate, and MuJoCo's settings.

use twinrig_legged::{LeggedError, Setup};

use crate::engine::EngineError;

/// Coordinates of the legs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// Every segment is a separate body, connected to its neighbours by pins: the thesis' third
    /// model, and the default.
    Maximal,
    /// Joint angles, without constraints in the joints.
    Minimal,
}

impl Coordinates {
    /// All variants, the default first.
    pub const ALL: [Self; 2] = [Self::Maximal, Self::Minimal];

    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Maximal => "maximal",
            Self::Minimal => "minimal",
        }
    }
}

/// Time integrator; the equations are in MuJoCo's manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// Symplectic Euler, of first order; joint friction is implicit.
    Euler,
    /// Symplectic Euler, of first order; all damping is implicit.
    Implicit,
    /// `Implicit` without the derivatives of inertial forces.
    ImplicitFast,
    /// Springs are implicit, too, and accounted for in the constraints: stable at any stiffness,
    /// with damping of fast oscillations.
    Discrete,
    /// Runge–Kutta, of fourth order without contacts.
    Rk4,
}

impl Integrator {
    /// All variants.
    pub const ALL: [Self; 5] = [
        Self::ImplicitFast,
        Self::Rk4,
        Self::Euler,
        Self::Implicit,
        Self::Discrete,
    ];

    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Implicit => "implicit",
            Self::ImplicitFast => "implicitfast",
            Self::Discrete => "discrete",
            Self::Rk4 => "rk4",
        }
    }

    /// Returns the name in MJCF.
    pub(crate) const fn keyword(self) -> &'static str {
        match self {
            Self::Euler => "Euler",
            Self::Rk4 => "RK4",
            other => other.name(),
        }
    }
}

/// Solver of the constraint forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Newton's method: few iterations, to full accuracy.
    Newton,
    /// Conjugate gradients.
    Cg,
    /// Projected Gauss–Seidel, row by row.
    Pgs,
}

impl Solver {
    /// All variants, the default first.
    pub const ALL: [Self; 3] = [Self::Newton, Self::Cg, Self::Pgs];

    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Newton => "newton",
            Self::Cg => "cg",
            Self::Pgs => "pgs",
        }
    }

    /// Returns the name in MJCF.
    pub(crate) const fn keyword(self) -> &'static str {
        match self {
            Self::Newton => "Newton",
            Self::Cg => "CG",
            Self::Pgs => "PGS",
        }
    }
}

/// Shape of the friction cone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cone {
    /// Coulomb's cone.
    Elliptic,
    /// A pyramid inscribed in it.
    Pyramidal,
}

impl Cone {
    /// Both variants, the default first.
    pub const ALL: [Self; 2] = [Self::Elliptic, Self::Pyramidal];

    /// Returns the name in scenarios and in MJCF.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Elliptic => "elliptic",
            Self::Pyramidal => "pyramidal",
        }
    }
}

/// Time constant with which constraint errors are corrected, as of MuJoCo's `solref`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeConstant {
    /// A number of the plant's maximum steps. Two are the stiffest setting that MuJoCo permits.
    Steps(f64),
    /// A time in seconds, independent of the step.
    Seconds(f64),
}

/// MuJoCo's settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numerics {
    /// Time integrator.
    pub integrator: Integrator,
    /// Solver of the constraint forces.
    pub solver: Solver,
    /// Maximum number of the solver's iterations in a step.
    pub iterations: u32,
    /// Improvement at which the solver stops, in MuJoCo's scaling \[1\].
    pub tolerance: f64,
    /// Shape of the friction cone.
    pub cone: Cone,
    /// Time constant of the constraints.
    pub closing: TimeConstant,
    /// Damping ratio of the constraints \[1\].
    pub damping: f64,
    /// Damping ratio of the pins between segments, in maximal coordinates \[1\].
    pub pin_damping: f64,
    /// Damping ratio of feet on the ground. A landing foot penetrates the ground by its motion in a
    /// step; the more this exceeds one, the slower it is pushed out, and the less it bounces \[1\].
    pub contact_damping: f64,
    /// Impedance of feet on the ground, as `impedance` \[1\].
    pub contact_impedance: [f64; 2],
    /// Maximum number of repeated force computations in a step for sliding feet, which MuJoCo lifts
    /// off the ground, unlike Coulomb's law. Zero keeps MuJoCo's forces. Only for elliptic cones.
    pub sliding_rounds: u32,
    /// Impedance of a constraint, MuJoCo's d: the enforced share of the reference acceleration,
    /// below 1 \[1\]. First without violation, then at a violation of `width`.
    pub impedance: [f64; 2],
    /// Violation at which the second impedance is reached \[m, rad\].
    pub width: f64,
    /// Whether Jacobians are sparse; with few degrees of freedom, dense ones take less time.
    pub sparse: bool,
    /// Whether MuJoCo solves each group of coupled constraints separately.
    pub islands: bool,
    /// Stiffness of friction relative to that of the normal force \[1\].
    pub impratio: f64,
    /// Whether MuJoCo raises time constants below two steps to two steps, which is its default.
    /// Without it, a constraint that is stiffer than the step can resolve diverges.
    pub refsafe: bool,
}

impl Numerics {
    /// Returns the settings with the smallest measured errors in these coordinates: see the table
    /// in the crate's documentation.
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
            closing: TimeConstant::Steps(2.0),
            damping: 1.0,
            pin_damping: 0.7,
            contact_damping: 1.0,
            contact_impedance: [0.9999, 0.9999],
            sliding_rounds: 10,
            impedance: [0.999, 0.999],
            width: 1e-3,
            sparse: true,
            islands: true,
            impratio: 1.0,
            refsafe: true,
        }
    }

    /// Returns these settings with MuJoCo's default softness of the constraints.
    #[must_use]
    pub const fn with_soft_constraints(self) -> Self {
        Self {
            closing: TimeConstant::Seconds(0.02),
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

/// Options of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Setup shared by all plants of the robot.
    pub setup: Setup,
    /// Coordinates of the legs.
    pub coordinates: Coordinates,
    /// MuJoCo's settings.
    pub numerics: Numerics,
    /// Whether a step is MuJoCo's step alone, to measure its cost: without energy balance, forces
    /// of the drives, limits of their torque that depend on the rate, corrected friction
    /// ([`Numerics::sliding_rounds`]) and checks. Not for [`Drives::Motors`].
    ///
    /// [`Drives::Motors`]: twinrig_legged::Drives::Motors
    pub step_only: bool,
    /// Whether servos are MuJoCo's position actuators, which a load deflects, in place of
    /// flywheels with clutches, which it does not up to their torque. Only for steps of MuJoCo
    /// alone.
    pub position_actuators: bool,
}

impl Options {
    /// Returns options with the default settings in these coordinates.
    pub fn new(setup: Setup, coordinates: Coordinates) -> Self {
        Self {
            setup,
            coordinates,
            numerics: Numerics::of(coordinates),
            step_only: false,
            position_actuators: false,
        }
    }
}

/// Reason why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MujocoError {
    /// Robot and setup do not fit together.
    #[error(transparent)]
    Legged(#[from] LeggedError),
    /// MuJoCo refuses the model, or is not available in the required version.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A setting has an invalid value.
    #[error("{setting} cannot be {value}: {why}")]
    Setting {
        /// Its name in scenarios.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// The requirement.
        why: &'static str,
    },
    /// Settings are incompatible.
    #[error("{0}")]
    Incompatible(&'static str),
}

impl Numerics {
    /// Refuses invalid and incompatible settings.
    pub(crate) fn check(&self) -> Result<(), MujocoError> {
        let (closing, time) = match self.closing {
            TimeConstant::Steps(steps) => ("solref_steps", steps),
            TimeConstant::Seconds(seconds) => ("solref_time", seconds),
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
                    why: "it has to be from 0.0001 to 0.9999; MuJoCo silently clamps it",
                });
            }
        }
        if self.iterations == 0 {
            return Err(MujocoError::Setting {
                setting: "iterations",
                value: 0.0,
                why: "the solver needs at least one",
            });
        }
        if self.refsafe && matches!(self.closing, TimeConstant::Steps(steps) if steps < 2.0) {
            return Err(MujocoError::Incompatible(
                "MuJoCo raises a `solref_steps` below 2 to 2: take 2, or set `refsafe = \"off\"`, with which such \
                 stiff constraints may diverge",
            ));
        }
        Ok(())
    }
}
