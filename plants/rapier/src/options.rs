//! What to simulate, and how the engine shall solve it.

use rapier3d_f64::dynamics::SpringCoefficients;
use twinrig_legged::{LeggedError, Setup};

const TURN: f64 = 2.0 * core::f64::consts::PI;

/// What holds the segments together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Joints {
    /// Impulses on bodies that know nothing of each other: maximal coordinates, gaps in the joints.
    Impulse,
    /// A tree in the coordinates of its joints: no gaps.
    Multibody,
}

impl Joints {
    /// Both, the default first.
    pub const ALL: [Self; 2] = [Self::Impulse, Self::Multibody];

    /// Its name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Impulse => "impulse",
            Self::Multibody => "multibody",
        }
    }
}

/// How stiffly the engine takes back what a constraint is off by, as if a spring did.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Softness {
    /// Of that spring \[Hz\].
    pub natural_frequency: f64,
    /// Of that spring \[1\].
    pub damping_ratio: f64,
}

impl Softness {
    pub(crate) fn coefficients(self) -> SpringCoefficients<f64> {
        SpringCoefficients::new(self.natural_frequency, self.damping_ratio)
    }

    /// The same in a step of `seconds`, taking errors back no faster than at one over `whole` seconds.
    ///
    /// The engine's rate is 1/(h + 2ζ/ω). Where that is too fast, ω and ζ both grow so far that nothing yields and only the
    /// rate is left of them.
    pub(crate) fn for_a_step(self, seconds: f64, whole: f64) -> SpringCoefficients<f64> {
        /// Beside it, what the engine makes of ζ⁻² as compliance is less than 1e-6 even of a step of a nanosecond.
        const DAMPED: f64 = 1e8;
        let delay = self.delay();
        if whole <= seconds || seconds + delay >= whole {
            return self.coefficients();
        }
        let hertz = 2.0 * DAMPED / (TURN * (whole - seconds));
        SpringCoefficients::new(hertz, DAMPED)
    }

    /// The same in a step of `seconds`, as hard as in one of `whole` seconds: what cannot be told from rigid there must not
    /// become a spring in a nanosecond.
    pub(crate) fn as_hard_as_in(self, seconds: f64, whole: f64) -> SpringCoefficients<f64> {
        if self.delay() >= whole {
            return self.coefficients();
        }
        SpringCoefficients::new(
            self.natural_frequency * (whole / seconds).max(1.0),
            self.damping_ratio,
        )
    }

    /// In which an error is taken back, beyond a step: 2ζ/ω \[s\].
    fn delay(self) -> f64 {
        2.0 * self.damping_ratio / (TURN * self.natural_frequency)
    }
}

/// How the engine solves a step; the names are its own.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Solver {
    /// Steps of the engine in one of ours, for each of which the forces are computed anew.
    pub substeps: u32,
    /// Substeps of the engine's own (`num_solver_iterations`), over which it holds the forces.
    pub solver_iterations: u32,
    /// Sweeps over the constraints in each of them (`num_internal_pgs_iterations`).
    pub pgs_iterations: u32,
    /// As many at least in steps in which a foot lands, and in the next: what a landing does goes through the whole leg and
    /// its stops at once.
    pub landing_iterations: u32,
    /// Sweeps after each that take back the speed with which errors were corrected (`num_internal_stabilization_iterations`).
    pub stabilization_iterations: u32,
    /// Of joints, stops and cables.
    pub joint_softness: Softness,
    /// Of feet on the ground.
    pub contact_softness: Softness,
}

impl Solver {
    /// The settings that measured best for these joints (`examples/settings.rs`).
    pub const fn best(joints: Joints) -> Self {
        let sweeps = match joints {
            Joints::Impulse => 300,
            Joints::Multibody => 20,
        };
        let landing_iterations = match joints {
            Joints::Impulse => 2000,
            Joints::Multibody => 20,
        };
        Self {
            substeps: 1,
            solver_iterations: 1,
            pgs_iterations: sweeps,
            landing_iterations,
            stabilization_iterations: 0,
            joint_softness: Softness {
                natural_frequency: 1e6,
                damping_ratio: 1.0,
            },
            // Trots fall on harder ground that run in other plants: see the crate.
            contact_softness: Softness {
                natural_frequency: 400.0,
                damping_ratio: 1.0,
            },
        }
    }

    /// Those that the engine comes with.
    pub const fn of_the_engine() -> Self {
        Self {
            substeps: 1,
            solver_iterations: 4,
            pgs_iterations: 1,
            landing_iterations: 1,
            stabilization_iterations: 1,
            joint_softness: Softness {
                natural_frequency: 1e6,
                damping_ratio: 1.0,
            },
            contact_softness: Softness {
                natural_frequency: 60.0,
                damping_ratio: 10.0,
            },
        }
    }

    fn check(&self) -> Result<(), RapierError> {
        let counts = [
            ("substeps", self.substeps),
            ("solver_iterations", self.solver_iterations),
            ("pgs_iterations", self.pgs_iterations),
            ("landing_iterations", self.landing_iterations),
        ];
        if let Some((what, _)) = counts.into_iter().find(|(_, count)| *count == 0) {
            return Err(RapierError::Count(what));
        }
        for (of, soft) in [
            ("joint", self.joint_softness),
            ("contact", self.contact_softness),
        ] {
            let Softness {
                natural_frequency: hertz,
                damping_ratio: ratio,
            } = soft;
            if !(hertz.is_finite() && hertz > 0.0) {
                return Err(RapierError::Softness(of, "natural frequency", hertz));
            }
            if !(ratio.is_finite() && ratio > 0.0) {
                return Err(RapierError::Softness(of, "damping ratio", ratio));
            }
        }
        Ok(())
    }
}

/// What to simulate of a robot, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What every plant of the robot is told.
    pub setup: Setup,
    /// What holds the segments together.
    pub joints: Joints,
    /// How the engine solves a step.
    pub solver: Solver,
    /// Moment of inertia of a segment about itself, as a share of that across: a thin rod has none, which the engine cannot
    /// have.
    pub axial_share: f64,
}

impl Options {
    /// Small beside the rest of the robot's inertia, and large enough for the sweeps to converge.
    pub const AXIAL_SHARE: f64 = 0.05;

    /// The best settings for these joints.
    pub fn new(setup: Setup, joints: Joints) -> Self {
        Self {
            setup,
            joints,
            solver: Solver::best(joints),
            axial_share: Self::AXIAL_SHARE,
        }
    }

    pub(crate) fn check(&self) -> Result<(), RapierError> {
        self.solver.check()?;
        if self.axial_share.is_finite() && self.axial_share > 0.0 {
            Ok(())
        } else {
            Err(RapierError::AxialShare(self.axial_share))
        }
    }
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RapierError {
    /// Robot and setup do not fit together.
    #[error(transparent)]
    Legged(#[from] LeggedError),
    /// A number of steps or sweeps is zero.
    #[error("{0} is 0; it has to be 1 or more")]
    Count(&'static str),
    /// A softness that is none.
    #[error("the {1} of the {0} softness is {2}; it has to be positive")]
    Softness(&'static str, &'static str, f64),
    /// A share of inertia that the engine cannot have.
    #[error("segments have {0} of their inertia about themselves; it has to be positive")]
    AxialShare(f64),
}
