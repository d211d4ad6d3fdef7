//! Constraints inside a leg: closed stops, a taut cable, a motor that follows its command.
//!
//! None of them depends on the trunk, so each is eliminated from the equations of the leg before
//! the rest is solved, and reduces the rank of the mobility by one. Starting from Φ = H⁻¹ and x =
//! 0, a constraint J θ̈ = b changes
//!
//! ```text
//! y = Φ Jᵀ    s = J y + c    Φ ← Φ − y yᵀ/s    x ← x + y (b − J x)/s
//! ```
//!
//! after which θ̈ = Φ f + x satisfies it for every f. The compliance c is the mobility at the far
//! end (a pulley whose motor is saturated); it is zero for a stop. A constraint implied by those
//! before it has s = 0 and must not be active.

use crate::model::chain::Chain;
use crate::model::constants::Constants;
use crate::model::real::Real;

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
    fn at_most(length: &crate::model::chain::Length<R>, most: R) -> Constraint<R, N> {
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
    fn either(self, one: R, other: &Self, two: R) -> Self {
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

/// Mobility of a leg with constraints eliminated: θ̈ = Φ f + x.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegMobility<R, const N: usize> {
    /// Φ, symmetric, of rank N minus the number of active constraints.
    pub(crate) matrix: [[R; N]; N],
    /// x: accelerations imposed by the constraints \[rad/s²\].
    pub(crate) imposed: [R; N],
    eliminated: [EliminatedConstraint<R, N>; CONSTRAINTS],
}

/// Data of an eliminated constraint, from which its force is recovered.
#[derive(Debug, Clone, Copy)]
struct EliminatedConstraint<R, const N: usize> {
    gradient: [R; N],
    /// y, and 1/s where it is active.
    response: [R; N],
    inverse: R,
    /// b − J x before the elimination.
    missing: R,
}

impl<R: Real, const N: usize> LegMobility<R, N> {
    /// Zero-initialised storage.
    #[inline(always)]
    pub(crate) fn blank() -> Self {
        let zero = R::zero();
        let none = EliminatedConstraint {
            gradient: [zero; N],
            response: [zero; N],
            inverse: zero,
            missing: zero,
        };
        Self {
            matrix: [[zero; N]; N],
            imposed: [zero; N],
            eliminated: [none; CONSTRAINTS],
        }
    }

    /// Mobility of a leg without constraints.
    #[inline(always)]
    pub(crate) fn free(inertia: &[[R; N]; N]) -> Self {
        Self {
            matrix: inverse(inertia),
            ..Self::blank()
        }
    }

    /// Eliminates the constraint `J θ̈ = target` where `active` is one. `compliance` is c.
    #[inline(always)]
    pub(crate) fn eliminate(
        &mut self,
        index: usize,
        gradient: &[R; N],
        target: R,
        compliance: R,
        active: R,
    ) {
        let mut response = [R::zero(); N];
        let (mut denominator, mut missing) = (compliance, target);
        for i in 0..N {
            let mut sum = R::zero();
            for j in 0..N {
                sum += self.matrix[i][j] * gradient[j];
            }
            response[i] = sum;
            denominator += gradient[i] * sum;
            missing -= gradient[i] * self.imposed[i];
        }
        // Where it is inactive, s = 1 keeps the quotient finite.
        let inverse = active / (denominator * active + (R::splat(1.0) - active));
        for i in 0..N {
            let scaled = response[i] * inverse;
            for j in 0..N {
                self.matrix[i][j] -= scaled * response[j];
            }
            self.imposed[i] += scaled * missing;
        }
        self.eliminated[index] = EliminatedConstraint {
            gradient: *gradient,
            response,
            inverse,
            missing,
        };
    }

    /// Returns the accelerations under these torques.
    #[inline(always)]
    pub(crate) fn accelerations(&self, torques: &[R; N]) -> [R; N] {
        let mut accelerations = self.imposed;
        for i in 0..N {
            for j in 0..N {
                accelerations[i] += self.matrix[i][j] * torques[j];
            }
        }
        accelerations
    }

    /// Returns the change of the accelerations by torques: Φ f.
    #[inline(always)]
    pub(crate) fn change(&self, torques: &[R; N]) -> [R; N] {
        let mut change = [R::zero(); N];
        for i in 0..N {
            for j in 0..N {
                change[i] += self.matrix[i][j] * torques[j];
            }
        }
        change
    }

    /// Returns the constraint forces under these torques.
    #[inline(always)]
    pub(crate) fn forces(&self, torques: &[R; N]) -> [R; CONSTRAINTS] {
        let (mut torques, mut forces) = (*torques, [R::zero(); CONSTRAINTS]);
        for index in (0..CONSTRAINTS).rev() {
            let eliminated = &self.eliminated[index];
            let mut missing = eliminated.missing;
            for i in 0..N {
                missing -= eliminated.response[i] * torques[i];
            }
            let force = missing * eliminated.inverse;
            for i in 0..N {
                torques[i] += eliminated.gradient[i] * force;
            }
            forces[index] = force;
        }
        forces
    }
}

/// Returns the inverse of a symmetric, positive definite matrix.
#[inline(always)]
fn inverse<R: Real, const N: usize>(a: &[[R; N]; N]) -> [[R; N]; N] {
    let mut out = [[R::zero(); N]; N];
    // The leading 3 × 3 block by cofactors, which needs a single division.
    let (p, q, r) = (
        a[1][1] * a[2][2] - a[1][2] * a[1][2],
        a[0][2] * a[1][2] - a[0][1] * a[2][2],
        a[0][1] * a[1][2] - a[0][2] * a[1][1],
    );
    let per = R::splat(1.0) / (a[0][0] * p + a[0][1] * q + a[0][2] * r);
    out[0][0] = p * per;
    out[0][1] = q * per;
    out[0][2] = r * per;
    out[1][1] = (a[0][0] * a[2][2] - a[0][2] * a[0][2]) * per;
    out[1][2] = (a[0][1] * a[0][2] - a[0][0] * a[1][2]) * per;
    out[2][2] = (a[0][0] * a[1][1] - a[0][1] * a[0][1]) * per;
    for i in 0..3 {
        for j in 0..i {
            out[i][j] = out[j][i];
        }
    }
    // Each further row by bordering.
    for n in 3..N {
        let (mut y, mut s) = ([R::zero(); N], a[n][n]);
        for i in 0..n {
            for j in 0..n {
                y[i] += out[i][j] * a[j][n];
            }
            s -= y[i] * a[i][n];
        }
        let per = R::splat(1.0) / s;
        for i in 0..n {
            for j in 0..n {
                out[i][j] += y[i] * y[j] * per;
            }
            out[i][n] = -(y[i] * per);
            out[n][i] = out[i][n];
        }
        out[n][n] = per;
    }
    out
}

/// Active constraints with the parameters of their stabilisation. Errors decay at the rate
/// `recovery` \[1/s\], critically damped.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConstraintSet<'a, R> {
    pub(crate) active: &'a ActiveConstraints<R>,
    pub(crate) drive: &'a DriveAction<R>,
    pub(crate) recovery: R,
    /// Time over which joint friction is implicit in the accelerations \[s\]: half a step of an
    /// implicit rule, or zero.
    pub(crate) implicit_seconds: f64,
    /// Kinds of constraints that are active in at least one lane; the others are skipped.
    pub(crate) any: [bool; CONSTRAINTS],
}

impl<R: Real, const N: usize> Chain<R, N> {
    /// Returns the mobility of the leg with these constraints eliminated.
    #[inline(always)]
    pub(crate) fn mobility(
        &self,
        leg: &Constants<R, N>,
        angles: &[R; N],
        constraint_set: &ConstraintSet<'_, R>,
    ) -> LegMobility<R, N> {
        let ConstraintSet {
            active,
            drive,
            recovery,
            implicit_seconds,
            any,
        } = constraint_set;
        let zero = R::zero();
        let mut inertia = self.inertia;
        inertia[0][0] += drive.hip_inertia;
        if *implicit_seconds > 0.0 {
            let weight = R::splat(*implicit_seconds);
            for i in 0..N {
                let friction = weight * leg.friction[i];
                inertia[i][i] += friction;
                if i > 0 {
                    inertia[i - 1][i - 1] += friction;
                    inertia[i - 1][i] -= friction;
                    inertia[i][i - 1] -= friction;
                }
            }
        }
        let mut mobility = LegMobility::free(&inertia);
        let target = |constraint: &Constraint<R, N>| {
            -(constraint.curvature
                + *recovery * (R::splat(2.0) * constraint.rate + *recovery * constraint.gap))
        };
        if any[HIP] {
            let mut gradient = [zero; N];
            gradient[0] = R::splat(1.0);
            mobility.eliminate(HIP, &gradient, drive.hip_acceleration, zero, active.hip);
        }
        if any[PANTOGRAPH] {
            let constraint =
                self.closed(leg, angles)
                    .either(active.closed, &self.open(leg), active.open);
            let active = active.closed + active.open;
            mobility.eliminate(
                PANTOGRAPH,
                &constraint.gradient,
                target(&constraint),
                zero,
                active,
            );
        }
        if any[DIAGONAL] {
            let extended = self.extended(leg);
            let constraint = extended.either(active.extended, &self.bottomed(leg), active.bottomed);
            let active = active.extended + active.bottomed;
            mobility.eliminate(
                DIAGONAL,
                &constraint.gradient,
                target(&constraint),
                zero,
                active,
            );
        }
        if any[CABLE] {
            let constraint = self.taut(leg, drive);
            let radius = leg.pulley_radius;
            mobility.eliminate(
                CABLE,
                &constraint.gradient,
                target(&constraint) + radius * drive.pulley_acceleration,
                radius * radius * drive.pulley_mobility,
                active.cable,
            );
        }
        mobility
    }
}
