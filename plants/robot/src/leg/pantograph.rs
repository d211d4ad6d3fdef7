//! Pantograph mechanism: lengths, derived quantities and inverse kinematics.

use crate::Leg;
use libm::{acos, atan2, cos, sin, sqrt};

use crate::leg::LegError;
use crate::triangle::third_side;

/// A planar vector in the leg plane: x forward, z up \[m\].
pub type Planar = nalgebra::Vector2<f64>;

/// Returns the vector rotated by +90°.
pub(crate) fn rotated(v: Planar) -> Planar {
    Planar::new(-v.y, v.x)
}

/// Returns the z component of the cross product of two planar vectors.
pub(crate) fn cross(a: Planar, b: Planar) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Returns the unit vector of a link angle: zero points straight down, positive swings forward.
pub(crate) fn along(angle: f64) -> Planar {
    Planar::new(sin(angle), -cos(angle))
}

/// Tolerance of lengths for rounding errors \[m\].
const ROUNDING: f64 = 1e-12;

fn checked_length(foot: Planar) -> Result<f64, LegError> {
    let length = foot.norm();
    if length.is_finite() {
        Ok(length)
    } else {
        Err(LegError::NotFinite {
            what: "foot position",
        })
    }
}

/// Returns the angle whose cosine is `cosine`; rounding errors beyond [-1, 1] are clamped.
pub(crate) fn angle_of(cosine: f64, what: &'static str, value: f64) -> Result<f64, LegError> {
    if cosine.abs() <= 1.0 + ROUNDING {
        Ok(acos(cosine.clamp(-1.0, 1.0)))
    } else {
        Err(LegError::NoAngle {
            what,
            value,
            cosine,
        })
    }
}

/// Spring-loaded pantograph: lengths of the segments and derived constants.
#[derive(Debug, Clone, PartialEq)]
pub struct Pantograph {
    pub(crate) l1: f64,
    pub(crate) l2: f64,
    /// Length of the distal segment below the ankle, `l3 - l_delta`.
    pub(crate) b: f64,
    pub(crate) l_delta: f64,
    /// Inverses of `l2` and `b`: a product costs a tenth of a quotient.
    pub(crate) per_l2: f64,
    pub(crate) per_b: f64,
    pub(crate) q2_ref: f64,
    pub(crate) k_d: f64,
    pub(crate) k_p: f64,
    /// Length of the unloaded diagonal spring.
    pub(crate) diagonal_rest: f64,
    /// Length of the unloaded parallel spring.
    pub(crate) parallel_rest: f64,
    pub(crate) diagonal_max: f64,
    pub(crate) diagonal_min: f64,
    pub(crate) parallel_max: f64,
    pub(crate) cable_max: f64,
    pub(crate) pulley_radius: f64,
    pub(crate) length_max: f64,
    pub(crate) length_min: f64,
    /// Least distance of knee and foot at which they determine the pose.
    pub(crate) span_min: f64,
    /// Absolute angle of the first segment in the reference pose (thesis, A.12 with its sign
    /// corrected).
    pub(crate) hip_ref: f64,
}

/// Motor positions that place the foot of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegCommand {
    /// Hip angle, zero in the reference pose, positive forward \[rad\].
    pub hip: f64,
    /// Angle of the cable pulley, zero with the leg extended, positive when winding up \[rad\].
    pub knee: f64,
}

fn positive(parameter: &'static str, value: f64) -> Result<(), LegError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(LegError::Geometry {
            parameter,
            value,
            why: "must be positive and finite",
        })
    }
}

impl Pantograph {
    /// Derives the mechanism from a robot's parameters.
    ///
    /// # Errors
    /// [`LegError::Geometry`] where the parameters do not form a pantograph.
    pub fn new(leg: &Leg) -> Result<Self, LegError> {
        for (parameter, value) in [
            ("l1", leg.l1),
            ("l2", leg.l2),
            ("l3", leg.l3),
            ("l_delta", leg.l_delta),
            ("q2_ref", leg.q2_ref),
            ("diagonal.stiffness", leg.diagonal.stiffness),
            ("parallel.stiffness", leg.parallel.stiffness),
            ("parallel_travel", leg.parallel_travel),
            ("diagonal_min", leg.diagonal_min),
            ("pulley_radius", leg.pulley_radius),
        ] {
            positive(parameter, value)?;
        }
        let (l1, l2, l_delta) = (leg.l1, leg.l2, leg.l_delta);
        let b = leg.l3 - l_delta;
        if l_delta >= l1 || b <= 0.0 {
            let why = "must be less than l1 and l3";
            return Err(LegError::Geometry {
                parameter: "l_delta",
                value: l_delta,
                why,
            });
        }
        if leg.q2_ref >= core::f64::consts::PI {
            return Err(LegError::Geometry {
                parameter: "q2_ref",
                value: leg.q2_ref,
                why: "must be below 180°",
            });
        }
        let diagonal_max = third_side(l2, l_delta, leg.q2_ref);
        if leg.diagonal_min <= (l2 - l_delta).abs() || leg.diagonal_min >= diagonal_max {
            let why = "must lie between |l2 - l_delta| and the diagonal of the extended leg";
            return Err(LegError::Geometry {
                parameter: "diagonal_min",
                value: leg.diagonal_min,
                why,
            });
        }
        if leg.parallel_travel >= diagonal_max + l_delta - l2 {
            let why = "must keep the extended parallel rod shorter than diagonal_max + l_delta";
            return Err(LegError::Geometry {
                parameter: "parallel_travel",
                value: leg.parallel_travel,
                why,
            });
        }
        let a = l1 + b;
        let length_max = third_side(l2, a, leg.q2_ref);
        let bottomed = (leg.diagonal_min * leg.diagonal_min - l2 * l2 - l_delta * l_delta)
            / (2.0 * l2 * l_delta);
        let length_min = sqrt(l2 * l2 + a * a + 2.0 * l2 * a * bottomed);
        let hip_ref = angle_of(
            (a * a + length_max * length_max - l2 * l2) / (2.0 * a * length_max),
            "length_max",
            length_max,
        )?;
        Ok(Self {
            l1,
            l2,
            b,
            l_delta,
            per_l2: 1.0 / l2,
            per_b: 1.0 / b,
            q2_ref: leg.q2_ref,
            k_d: leg.diagonal.stiffness,
            k_p: leg.parallel.stiffness,
            diagonal_rest: diagonal_max + leg.diagonal.preload,
            parallel_rest: l2 - leg.parallel.preload,
            diagonal_max,
            diagonal_min: leg.diagonal_min,
            parallel_max: l2 + leg.parallel_travel,
            cable_max: third_side(l1, l2, leg.q2_ref),
            pulley_radius: leg.pulley_radius,
            length_max,
            length_min,
            span_min: Self::least_span(l2, b),
            hip_ref,
        })
    }

    /// Returns the distance from hip to foot in the reference pose \[m\] (thesis, A.11 corrected).
    pub fn length_max(&self) -> f64 {
        self.length_max
    }

    /// Returns the distance from hip to foot with the diagonal bottomed out and the pantograph
    /// closed \[m\].
    pub fn length_min(&self) -> f64 {
        self.length_min
    }

    /// Returns the length of the diagonal in the reference pose, at its stop \[m\].
    pub fn diagonal_max(&self) -> f64 {
        self.diagonal_max
    }

    /// Returns the shortest length of the diagonal, at its stop \[m\].
    pub fn diagonal_min(&self) -> f64 {
        self.diagonal_min
    }

    /// Returns the knee angle `q2` at which the diagonal bottoms out; negative \[rad\].
    ///
    /// # Errors
    /// [`LegError::NoAngle`] never for a mechanism that [`Self::new`] accepts.
    pub fn knee_bottomed(&self) -> Result<f64, LegError> {
        let cosine = (self.diagonal_min * self.diagonal_min
            - self.l2 * self.l2
            - self.l_delta * self.l_delta)
            / (2.0 * self.l2 * self.l_delta);
        Ok(self.q2_ref - angle_of(cosine, "diagonal_min", self.diagonal_min)?)
    }

    /// Returns the absolute angle of the first segment in the reference pose \[rad\].
    pub fn hip_reference(&self) -> f64 {
        self.hip_ref
    }

    /// Returns the length of the taut cable at a pulley angle \[m\].
    pub fn cable_length(&self, pulley: f64) -> f64 {
        self.cable_max - self.pulley_radius * pulley
    }

    /// Returns the radius of the cable pulley \[m\].
    pub fn pulley_radius(&self) -> f64 {
        self.pulley_radius
    }

    /// Solves the inverse kinematics with the pantograph closed (thesis, A.2–A.9 with A.6–A.9
    /// corrected).
    ///
    /// `foot` is the foot position in the hip frame, x forward and z up \[m\].
    ///
    /// # Errors
    /// [`LegError::OutOfReach`], [`LegError::NotFinite`].
    pub fn inverse_closed(&self, foot: Planar) -> Result<LegCommand, LegError> {
        let length = checked_length(foot)?;
        if !self.reaches(length) {
            return Err(LegError::OutOfReach {
                length,
                least: self.length_min,
                greatest: self.length_max,
            });
        }
        Ok(self.command_at(foot, length))
    }

    /// Solves the same for the reachable point nearest to `foot`; returns also the distance of
    /// `foot` from it, zero within reach \[m\].
    #[inline]
    pub fn inverse_nearest(&self, foot: Planar) -> (LegCommand, f64) {
        let length = foot.norm();
        if self.reaches(length) {
            return (self.command_at(foot, length), 0.0);
        }
        let nearest = self.nearest_reachable(foot);
        let beyond = Planar::new(foot.x - nearest.x, foot.y - nearest.y).norm();
        (self.command_at(nearest, nearest.norm()), beyond)
    }

    /// Returns whether a distance from hip to foot is in the range of the closed pantograph.
    #[inline]
    fn reaches(&self, length: f64) -> bool {
        (self.length_min - ROUNDING..=self.length_max + ROUNDING).contains(&length)
    }

    /// Returns the command that places the foot, with its distance from the hip.
    #[inline]
    fn command_at(&self, foot: Planar, length: f64) -> LegCommand {
        // First and distal segment act as one link of length `a`. The foot is at (along, across) in
        // its frame, and the hip angle rotates this to the requested position: one arc tangent.
        let a = self.l1 + self.b;
        let cosine =
            ((length * length - a * a - self.l2 * self.l2) / (2.0 * self.l2 * a)).clamp(-1.0, 1.0);
        let sine = -sqrt((1.0 - cosine) * (1.0 + cosine));
        let (along, across) = (a + self.l2 * cosine, self.l2 * sine);
        let hip = atan2(
            foot.x * along + foot.y * across,
            foot.x * across - foot.y * along,
        );
        let cable = sqrt(self.l1 * self.l1 + self.l2 * self.l2 + 2.0 * self.l1 * self.l2 * cosine);
        LegCommand {
            hip: hip - self.hip_ref,
            knee: (self.cable_max - cable) / self.pulley_radius,
        }
    }

    /// Solves the inverse kinematics with the distal segment rotated by `opening` \[rad\] against
    /// the first.
    ///
    /// For a fixed opening, first and distal segment act as one link of length ρ at the angle ψ
    /// from the first.
    ///
    /// # Errors
    /// [`LegError::NoAngle`] where no knee angle results in that length, [`LegError::NotFinite`].
    pub fn inverse_open(&self, foot: Planar, opening: f64) -> Result<LegCommand, LegError> {
        let length = checked_length(foot)?;
        let (rho, psi) = self.virtual_link(opening);
        let knee_cosine = (length * length - rho * rho - self.l2 * self.l2) / (2.0 * self.l2 * rho);
        let q2_bar = psi - angle_of(knee_cosine, "leg length", length)?;
        let (x, z) = self.foot_from_first(q2_bar, opening);
        let hip = atan2(foot.x, -foot.y) - atan2(z, x);
        let cable =
            sqrt(self.l1 * self.l1 + self.l2 * self.l2 + 2.0 * self.l1 * self.l2 * cos(q2_bar));
        Ok(LegCommand {
            hip: hip - self.hip_ref,
            knee: (self.cable_max - cable) / self.pulley_radius,
        })
    }

    /// Returns the foot position with the pantograph closed and the cable taut \[m\]: the inverse
    /// of [`Self::inverse_closed`].
    ///
    /// # Errors
    /// [`LegError::NoAngle`] where no knee angle matches the cable length.
    pub fn foot_of(&self, command: LegCommand) -> Result<Planar, LegError> {
        let q2_bar = self.knee_of_cable(self.cable_length(command.knee))? - self.q2_ref;
        let first = command.hip + self.hip_ref;
        Ok(along(first) * (self.l1 + self.b) + along(first + q2_bar) * self.l2)
    }

    /// Returns the reachable point nearest to `foot` on the ray from the hip through it; `foot`
    /// itself where reachable.
    pub fn nearest_reachable(&self, foot: Planar) -> Planar {
        let length = foot.norm();
        if length.is_nan() || length <= 0.0 {
            return Planar::new(0.0, -self.length_min);
        }
        foot * (length.clamp(self.length_min, self.length_max) / length)
    }

    /// Returns length and angle (from the first segment) of the link that first and distal segment
    /// form at an opening.
    pub(crate) fn virtual_link(&self, opening: f64) -> (f64, f64) {
        let (x, z) = (self.l1 + self.b * cos(opening), self.b * sin(opening));
        (sqrt(x * x + z * z), atan2(z, x))
    }

    /// Returns the foot position relative to the hip, along and across the first segment (thesis,
    /// A.29 and A.30 with its sign corrected).
    pub(crate) fn foot_from_first(&self, q2_bar: f64, opening: f64) -> (f64, f64) {
        (
            self.l1 + self.l2 * cos(q2_bar) + self.b * cos(opening),
            self.l2 * sin(q2_bar) + self.b * sin(opening),
        )
    }
}
