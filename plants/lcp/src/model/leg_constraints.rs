//! Constraints inside a leg: closed stops, a taut cable, a motor that follows its command.

use super::chain::{Chain, Length};
use super::constants::Constants;
use super::real::Real;

/// Constraints of a leg that may be active at once: motor, pantograph, diagonal, cable.
pub(crate) const CONSTRAINTS: usize = 4;

pub(crate) const HIP: usize = 0;
pub(crate) const PANTOGRAPH: usize = 1;
pub(crate) const DIAGONAL: usize = 2;
pub(crate) const CABLE: usize = 3;

/// Active constraints of a leg, as ones and zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ActiveConstraints<R> {
    /// The hip motor imposes the commanded acceleration on its link.
    pub(crate) hip: R,
    pub(crate) closed: R,
    pub(crate) open: R,
    pub(crate) extended: R,
    pub(crate) bottomed: R,
    pub(crate) cable: R,
}

/// Instantaneous action of the drives of a leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DriveAction<R> {
    /// Acceleration imposed by the hip motor where [`ActiveConstraints::hip`] is one \[rad/s²\].
    pub(crate) hip_acceleration: R,
    /// Torque \[N·m\] and inertia \[kg·m²\] of a saturated hip motor.
    pub(crate) hip_torque: R,
    pub(crate) hip_inertia: R,
    /// Angle \[rad\] and rate \[rad/s\] of the pulley, and its acceleration without cable tension
    /// \[rad/s²\].
    pub(crate) pulley: R,
    pub(crate) pulley_rate: R,
    pub(crate) pulley_acceleration: R,
    /// Mobility of the pulley of a saturated motor; zero where the motor follows its command
    /// \[1/(kg·m²)\].
    pub(crate) pulley_mobility: R,
}

/// One constraint of a leg: gap, rate of the gap, its gradient, and its second derivative at
/// constant rates of all angles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constraint<R, const N: usize> {
    pub(crate) gradient: [R; N],
    pub(crate) gap: R,
    pub(crate) rate: R,
    pub(crate) curvature: R,
}

impl<R: Real> DriveAction<R> {
    /// Action without motors.
    pub(crate) fn none() -> Self {
        let zero = R::zero();
        Self {
            hip_acceleration: zero,
            hip_torque: zero,
            hip_inertia: zero,
            pulley: zero,
            pulley_rate: zero,
            pulley_acceleration: zero,
            pulley_mobility: zero,
        }
    }
}

impl<R: Real, const N: usize> Chain<R, N> {
    /// Returns the lower stop of the pantograph, as a length at its offset.
    #[inline(always)]
    pub(crate) fn closed(&self, leg: &Constants<R, N>, angles: &[R; N]) -> Constraint<R, N> {
        let mut gradient = [R::zero(); N];
        (gradient[0], gradient[2]) = (-leg.l_delta, leg.l_delta);
        Constraint {
            gradient,
            gap: leg.l_delta * (angles[2] - angles[0]),
            rate: leg.l_delta * (self.rates[2] - self.rates[0]),
            curvature: R::zero(),
        }
    }

    #[inline(always)]
    pub(crate) fn open(&self, leg: &Constants<R, N>) -> Constraint<R, N> {
        Self::at_most(&self.parallel, leg.parallel_max)
    }

    #[inline(always)]
    pub(crate) fn extended(&self, leg: &Constants<R, N>) -> Constraint<R, N> {
        Self::at_most(&self.diagonal, leg.diagonal_max)
    }

    #[inline(always)]
    pub(crate) fn bottomed(&self, leg: &Constants<R, N>) -> Constraint<R, N> {
        Self::at_most(&self.diagonal, leg.diagonal_min).reversed()
    }

    /// Returns the taut cable; the gap also depends on the angle of the pulley.
    #[inline(always)]
    pub(crate) fn taut(&self, leg: &Constants<R, N>, drive: &DriveAction<R>) -> Constraint<R, N> {
        let mut constraint = Self::at_most(
            &self.cable,
            leg.cable_max - leg.pulley_radius * drive.pulley,
        );
        constraint.rate -= leg.pulley_radius * drive.pulley_rate;
        constraint
    }

    #[inline(always)]
    fn at_most(length: &Length<R>, most: R) -> Constraint<R, N> {
        let mut gradient = [R::zero(); N];
        for i in 0..3 {
            gradient[i] = -length.gradient[i];
        }
        Constraint {
            gradient,
            gap: most - length.value,
            rate: -length.rate,
            curvature: -length.curvature,
        }
    }
}

impl<R: Real, const N: usize> Constraint<R, N> {
    fn reversed(self) -> Self {
        Self {
            gradient: self.gradient.map(|g| -g),
            gap: -self.gap,
            rate: -self.rate,
            curvature: -self.curvature,
        }
    }

    /// Selects one of two constraints by the weights one and zero; the result is zero where both
    /// weights are.
    pub(super) fn either(self, one: R, other: &Self, two: R) -> Self {
        let blend = |a: R, b: R| one * a + two * b;
        let mut gradient = self.gradient;
        for i in 0..N {
            gradient[i] = blend(gradient[i], other.gradient[i]);
        }
        Self {
            gradient,
            gap: blend(self.gap, other.gap),
            rate: blend(self.rate, other.rate),
            curvature: blend(self.curvature, other.curvature),
        }
    }
}
