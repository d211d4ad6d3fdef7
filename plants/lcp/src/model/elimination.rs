//! Elimination of the constraints inside a leg from its equations.
//!
//! None of the constraints depends on the trunk, so each is eliminated before the rest is solved,
//! and reduces the rank of the mobility by one. Starting from Φ = H⁻¹ and x = 0, a constraint
//! J θ̈ = b changes
//!
//! ```text
//! y = Φ Jᵀ    s = J y + c    Φ ← Φ − y yᵀ/s    x ← x + y (b − J x)/s
//! ```
//!
//! after which θ̈ = Φ f + x satisfies it for every f. The compliance c is the mobility at the far
//! end (a pulley whose motor is saturated); it is zero for a stop. A constraint implied by those
//! before it has s = 0 and must not be active.

use super::chain::Chain;
use super::constants::Constants;
use super::leg_constraints::{
    ActiveConstraints, CABLE, CONSTRAINTS, Constraint, DIAGONAL, DriveAction, HIP, PANTOGRAPH,
};
use super::real::Real;

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
