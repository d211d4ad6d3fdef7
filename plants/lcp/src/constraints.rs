//! What holds inside a leg: stops that are closed, a cable that is taut, a motor that follows its command.
//!
//! None of these knows the trunk, so each is taken out of the leg's own equations before anything else is solved: one
//! direction less in which the leg gives way. With Φ = H⁻¹ to begin with, a constraint J θ̈ = b changes
//!
//! ```text
//! y = Φ Jᵀ    s = J y + c    Φ ← Φ − y yᵀ/s    x ← x + y (b − J x)/s
//! ```
//!
//! after which θ̈ = Φ f + x satisfies it for every f. c is what moves at the far end (a pulley out of torque); it is zero for
//! a stop. A constraint that those before it imply has s = 0 and takes no part.

use crate::chain::Chain;
use crate::constants::Constants;
use crate::real::Real;

/// The constraints that a leg may have at once: its motor, its pantograph, its diagonal, its cable.
pub(crate) const CONSTRAINTS: usize = 4;

pub(crate) const HIP: usize = 0;
pub(crate) const PANTOGRAPH: usize = 1;
pub(crate) const DIAGONAL: usize = 2;
pub(crate) const CABLE: usize = 3;

/// Which constraints of a leg hold, as ones and zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ActiveConstraints<R> {
    /// The hip's motor gives its link the acceleration it wants.
    pub(crate) hip: R,
    pub(crate) closed: R,
    pub(crate) open: R,
    pub(crate) extended: R,
    pub(crate) bottomed: R,
    pub(crate) cable: R,
}

/// What the drives of a leg do just now.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Driven<R> {
    /// Acceleration that the hip's motor imposes where [`ActiveConstraints::hip`] holds \[rad/s²\].
    pub(crate) hip_acceleration: R,
    /// Torque and inertia of a hip motor that is used up.
    pub(crate) hip_torque: R,
    pub(crate) hip_inertia: R,
    /// Position, rate, and acceleration of the pulley while no cable pulls at it.
    pub(crate) pulley: R,
    pub(crate) pulley_rate: R,
    pub(crate) pulley_acceleration: R,
    /// Mobility of a pulley whose motor is used up; zero where the motor follows its command \[1/(kg·m²)\].
    pub(crate) pulley_mobility: R,
}

/// One constraint of a leg: gap, rate of the gap, its gradient, and its second derivative while all angles move evenly.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constraint<R, const N: usize> {
    pub(crate) gradient: [R; N],
    pub(crate) gap: R,
    pub(crate) rate: R,
    pub(crate) curvature: R,
}

impl<R: Real> Driven<R> {
    /// No motors.
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
    /// The pantograph's lower stop, as a length at its offset.
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

    /// The taut cable; its gap closes with the pulley's angle, too.
    #[inline(always)]
    pub(crate) fn taut(&self, leg: &Constants<R, N>, drive: &Driven<R>) -> Constraint<R, N> {
        let mut constraint = Self::at_most(
            &self.cable,
            leg.cable_max - leg.pulley_radius * drive.pulley,
        );
        constraint.rate -= leg.pulley_radius * drive.pulley_rate;
        constraint
    }

    #[inline(always)]
    fn at_most(length: &crate::chain::Length<R>, most: R) -> Constraint<R, N> {
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

    /// One of two, by a one and a zero; neither where both are zero.
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

/// How a leg gives way to torques: θ̈ = Φ f + x.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Give<R, const N: usize> {
    /// Φ, symmetric, of rank N less the constraints.
    pub(crate) mobility: [[R; N]; N],
    /// x.
    pub(crate) imposed: [R; N],
    taken: [Taken<R, N>; CONSTRAINTS],
}

/// How a constraint was taken out: enough to find its force afterwards.
#[derive(Debug, Clone, Copy)]
struct Taken<R, const N: usize> {
    gradient: [R; N],
    /// y, and 1/s where it holds.
    response: [R; N],
    inverse: R,
    /// b − J x before.
    missing: R,
}

impl<R: Real, const N: usize> Give<R, N> {
    /// Room for one.
    #[inline(always)]
    pub(crate) fn blank() -> Self {
        let zero = R::zero();
        let none = Taken {
            gradient: [zero; N],
            response: [zero; N],
            inverse: zero,
            missing: zero,
        };
        Self {
            mobility: [[zero; N]; N],
            imposed: [zero; N],
            taken: [none; CONSTRAINTS],
        }
    }

    /// A leg that nothing holds.
    #[inline(always)]
    pub(crate) fn free(inertia: &[[R; N]; N]) -> Self {
        Self {
            mobility: inverse(inertia),
            ..Self::blank()
        }
    }

    /// Takes out the constraint `J θ̈ = target` where `active` is one. `compliance` is c.
    #[inline(always)]
    pub(crate) fn take(
        &mut self,
        place: usize,
        gradient: &[R; N],
        target: R,
        compliance: R,
        active: R,
    ) {
        let mut response = [R::zero(); N];
        let (mut own, mut missing) = (compliance, target);
        for i in 0..N {
            let mut sum = R::zero();
            for j in 0..N {
                sum += self.mobility[i][j] * gradient[j];
            }
            response[i] = sum;
            own += gradient[i] * sum;
            missing -= gradient[i] * self.imposed[i];
        }
        // Where it does not hold, s = 1 keeps the quotient a number.
        let inverse = active / (own * active + (R::splat(1.0) - active));
        for i in 0..N {
            let scaled = response[i] * inverse;
            for j in 0..N {
                self.mobility[i][j] -= scaled * response[j];
            }
            self.imposed[i] += scaled * missing;
        }
        self.taken[place] = Taken {
            gradient: *gradient,
            response,
            inverse,
            missing,
        };
    }

    /// Accelerations under these torques.
    #[inline(always)]
    pub(crate) fn accelerations(&self, torques: &[R; N]) -> [R; N] {
        let mut accelerations = self.imposed;
        for i in 0..N {
            for j in 0..N {
                accelerations[i] += self.mobility[i][j] * torques[j];
            }
        }
        accelerations
    }

    /// What torques change of the accelerations: Φ f.
    #[inline(always)]
    pub(crate) fn moved(&self, torques: &[R; N]) -> [R; N] {
        let mut moved = [R::zero(); N];
        for i in 0..N {
            for j in 0..N {
                moved[i] += self.mobility[i][j] * torques[j];
            }
        }
        moved
    }

    /// Forces of the constraints under these torques.
    #[inline(always)]
    pub(crate) fn forces(&self, torques: &[R; N]) -> [R; CONSTRAINTS] {
        let (mut torques, mut forces) = (*torques, [R::zero(); CONSTRAINTS]);
        for place in (0..CONSTRAINTS).rev() {
            let taken = &self.taken[place];
            let mut missing = taken.missing;
            for i in 0..N {
                missing -= taken.response[i] * torques[i];
            }
            let force = missing * taken.inverse;
            for i in 0..N {
                torques[i] += taken.gradient[i] * force;
            }
            forces[place] = force;
        }
        forces
    }
}

/// The inverse of a symmetric, positive definite matrix.
#[inline(always)]
fn inverse<R: Real, const N: usize>(a: &[[R; N]; N]) -> [[R; N]; N] {
    let mut out = [[R::zero(); N]; N];
    // The leading block of three by cofactors, which takes one quotient.
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
    // Every further row by bordering.
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

/// How fast an error of a constraint is taken back, critically damped \[1/s\], and which constraints hold.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConstraintSet<'a, R> {
    pub(crate) active: &'a ActiveConstraints<R>,
    pub(crate) drive: &'a Driven<R>,
    pub(crate) recovery: R,
    /// Seconds over which friction in the joints answers to accelerations: half a step of an implicit rule, or zero.
    pub(crate) ahead: f64,
    /// Which kinds of constraints hold in any lane; the others cost nothing.
    pub(crate) any: [bool; CONSTRAINTS],
}

impl<R: Real, const N: usize> Chain<R, N> {
    /// How the leg gives way with these constraints taken out.
    #[inline(always)]
    pub(crate) fn give(
        &self,
        leg: &Constants<R, N>,
        angles: &[R; N],
        held: &ConstraintSet<'_, R>,
    ) -> Give<R, N> {
        let ConstraintSet {
            active,
            drive,
            recovery,
            ahead,
            any,
        } = held;
        let zero = R::zero();
        let mut inertia = self.inertia;
        inertia[0][0] += drive.hip_inertia;
        if *ahead > 0.0 {
            let weight = R::splat(*ahead);
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
        let mut give = Give::free(&inertia);
        let target = |constraint: &Constraint<R, N>| {
            -(constraint.curvature
                + *recovery * (R::splat(2.0) * constraint.rate + *recovery * constraint.gap))
        };
        if any[HIP] {
            let mut gradient = [zero; N];
            gradient[0] = R::splat(1.0);
            give.take(HIP, &gradient, drive.hip_acceleration, zero, active.hip);
        }
        if any[PANTOGRAPH] {
            let constraint =
                self.closed(leg, angles)
                    .either(active.closed, &self.open(leg), active.open);
            let active = active.closed + active.open;
            give.take(
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
            give.take(
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
            give.take(
                CABLE,
                &constraint.gradient,
                target(&constraint) + radius * drive.pulley_acceleration,
                radius * radius * drive.pulley_mobility,
                active.cable,
            );
        }
        give
    }
}
