//! Options: what to simulate, and how the engine solves it.

use rapier3d_f64::dynamics::SpringCoefficients;
use twinrig_legged::{LeggedError, Setup};

const TURN: f64 = 2.0 * core::f64::consts::PI;

/// Kind of joints between the segments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Joints {
    /// Impulses between bodies in maximal coordinates: gaps in the joints.
    Impulse,
    /// A tree in joint coordinates: no gaps.
    Multibody,
}

impl Joints {
    /// Both kinds, the default first.
    pub const ALL: [Self; 2] = [Self::Impulse, Self::Multibody];

    /// Returns the name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Impulse => "impulse",
            Self::Multibody => "multibody",
        }
    }
}

/// Softness of a constraint: position errors are corrected as by a damped spring.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Softness {
    /// Natural frequency \[Hz\].
    pub natural_frequency: f64,
    /// Damping ratio \[1\].
    pub damping_ratio: f64,
}

impl Softness {
    pub(crate) fn coefficients(self) -> SpringCoefficients<f64> {
        SpringCoefficients::new(self.natural_frequency, self.damping_ratio)
    }

    /// Returns the coefficients for a step of `seconds`, with position errors corrected at a rate
    /// of at most one over `interval` seconds.
    ///
    /// The engine's rate is 1/(h + 2ζ/ω). Where that is too fast, ω and ζ are both increased so far
    /// that compliance vanishes and only the rate remains.
    pub(crate) fn for_step(self, seconds: f64, interval: f64) -> SpringCoefficients<f64> {
        /// So large that the engine's compliance, in ζ⁻², is below 1e-6 even for a step of a
        /// nanosecond.
        const DAMPED: f64 = 1e8;
        let delay = self.delay();
        if interval <= seconds || seconds + delay >= interval {
            return self.coefficients();
        }
        let hertz = 2.0 * DAMPED / (TURN * (interval - seconds));
        SpringCoefficients::new(hertz, DAMPED)
    }

    /// Returns the coefficients for a step of `seconds`, as stiff as in one of `interval` seconds:
    /// a constraint that is practically rigid there must not become a spring in a nanosecond.
    pub(crate) fn as_stiff_as_in(self, seconds: f64, interval: f64) -> SpringCoefficients<f64> {
        if self.delay() >= interval {
            return self.coefficients();
        }
        SpringCoefficients::new(
            self.natural_frequency * (interval / seconds).max(1.0),
            self.damping_ratio,
        )
    }

    /// Returns the correction time beyond a step, 2ζ/ω \[s\].
    fn delay(self) -> f64 {
        2.0 * self.damping_ratio / (TURN * self.natural_frequency)
    }
}

/// Settings of the engine's solver, with the engine's names.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Solver {
    /// Steps of the engine in one of the plant, for each of which the forces are computed anew.
    pub substeps: u32,
    /// The engine's own substeps (`num_solver_iterations`), over which it holds the forces
    /// constant.
    pub solver_iterations: u32,
    /// Sweeps over the constraints in each of them (`num_internal_pgs_iterations`).
    pub pgs_iterations: u32,
    /// Least number of sweeps in a step in which a foot lands, and in the next: the impulse of a
    /// landing propagates through the whole leg and its stops.
    pub landing_iterations: u32,
    /// Sweeps after each substep that remove the velocity of position corrections
    /// (`num_internal_stabilization_iterations`).
    pub stabilization_iterations: u32,
    /// Softness of joints, stops and cables.
    pub joint_softness: Softness,
    /// Softness of feet on the ground.
    pub contact_softness: Softness,
}

impl Solver {
    /// Returns the settings with the smallest measured errors for these joints
    /// (`examples/settings.rs`).
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
            // On harder ground trots fall that run in other plants: see the crate.
            contact_softness: Softness {
                natural_frequency: 400.0,
                damping_ratio: 1.0,
            },
        }
    }

    /// Returns the engine's default settings.
    pub const fn engine_defaults() -> Self {
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

/// Options of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Setup shared by all plants of the robot.
    pub setup: Setup,
    /// Kind of joints between the segments.
    pub joints: Joints,
    /// Settings of the solver.
    pub solver: Solver,
    /// Axial moment of inertia of a segment as a share of the transverse one: a thin rod has none,
    /// but the engine requires one.
    pub axial_share: f64,
    /// Whether a step is the engine's step alone, to measure its cost: springs and joint friction
    /// are joints of the engine, stops are its limits and ropes of constant length, and there is
    /// neither energy balance nor check. Only for [`Drives::None`] and [`Joints::Impulse`].
    ///
    /// [`Drives::None`]: twinrig_legged::Drives::None
    pub step_only: bool,
}

impl Options {
    /// Default share: small relative to the robot's inertia, and large enough for the sweeps to
    /// converge.
    pub const AXIAL_SHARE: f64 = 0.05;

    /// Returns options with the best settings for these joints.
    pub fn new(setup: Setup, joints: Joints) -> Self {
        Self {
            setup,
            joints,
            solver: Solver::best(joints),
            axial_share: Self::AXIAL_SHARE,
            step_only: false,
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

/// Reason why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RapierError {
    /// Robot and setup do not fit together.
    #[error(transparent)]
    Legged(#[from] LeggedError),
    /// A number of steps or sweeps is zero.
    #[error("{0} is 0; it has to be 1 or more")]
    Count(&'static str),
    /// A natural frequency or damping ratio is not positive.
    #[error("the {1} of the {0} softness is {2}; it has to be positive")]
    Softness(&'static str, &'static str, f64),
    /// Steps of the engine alone with drives or a tree.
    #[error(
        "steps of the engine alone include neither drives nor multibody joints, which need values of this crate in each step: \
         take `step_only = false`"
    )]
    StepOnly,
    /// The trunk has payloads.
    #[error(
        "a trunk with payloads is not supported: this plant measures hips, velocities and energies from the centre of mass of \
         each body, which payloads move; take `mujoco` or `lcp`, or leave the payloads out"
    )]
    Payload,
    /// Trunk, knees or ankles have contact with ground that is not flat.
    #[error(
        "trunk, knees and ankles have contact on flat ground only: take `contacts = \"feet\"`, or the plant `mujoco` or `lcp`"
    )]
    Contacts,
    /// Joints of abduction with a tree, or with steps of the engine alone.
    #[error(
        "legs abduct with `joints = \"impulse\"` only, and not in steps of the engine alone: choose these joints, or \
         `abduction = \"locked\"`"
    )]
    Abduction,
    /// Axes of abduction that are not balanced about the trunk's centre of mass.
    #[error(
        "legs abduct about axes at the height of the trunk's centre of mass, in pairs on both sides of it, only: the carriers \
         of others would move it; take `mujoco` or `lcp`"
    )]
    Balance,
    /// The axial share of inertia is not positive.
    #[error("the axial share of the segments' inertia is {0}; it has to be positive")]
    AxialShare(f64),
}
