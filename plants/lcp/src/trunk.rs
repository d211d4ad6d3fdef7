//! The trunk's own equations, with the legs taken out of them (Schur complement): six rows, whatever the number of legs.

use crate::carried::{Burden, COUPLED, Carried};
use crate::constraints::Give;
use crate::real::Real;

/// A vector of the trunk: linear, then angular, trunk axes.
pub(crate) type Spatial<T> = [T; 6];

/// What does not depend on the state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkConstants {
    /// Mass of trunk and legs \[kg\].
    pub(crate) mass: f64,
    /// Principal moments of the trunk alone \[kg·m²\].
    pub(crate) inertia: [f64; 3],
    /// Which of its directions it may move in: forward, left, up, roll, pitch, yaw.
    pub(crate) moves: [bool; 6],
}

pub(crate) fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The trunk in one state, legs included.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trunk<T> {
    /// Σ m r of the legs.
    pub(crate) moment: [T; 3],
    /// Moments of inertia about the trunk's centre of mass, all masses, symmetric.
    pub(crate) inertia: [[T; 3]; 3],
    /// Force and torque on it: gravity, and what velocities do.
    pub(crate) force: Spatial<T>,
}

impl<T: Real<Sum = T>> Trunk<T> {
    /// The inertia alone, from the burdens of the legs, already summed over the lanes.
    pub(crate) fn unloaded(constants: &TrunkConstants, burden: &Burden<T>) -> Self {
        let [xx, yy, zz, xy, xz, yz] = burden.spread;
        let own = constants.inertia.map(T::splat);
        Self {
            moment: burden.moment,
            inertia: [
                [own[0] + yy + zz, -xy, -xz],
                [-xy, own[1] + xx + zz, -yz],
                [-xz, -yz, own[2] + xx + yy],
            ],
            force: [T::zero(); 6],
        }
    }

    /// With forces. `field` is g − ω × v.
    pub(crate) fn new(
        constants: &TrunkConstants,
        burden: &Burden<T>,
        turning: [T; 3],
        field: [T; 3],
    ) -> Self {
        let Self {
            moment, inertia, ..
        } = Self::unloaded(constants, burden);
        let drift = [burden.drift[0], T::zero(), burden.drift[1]];
        let two = T::splat(2.0);
        let inward = cross(turning, cross(turning, moment));
        let coriolis = cross(turning, drift);
        let spin =
            inertia.map(|row| row[0] * turning[0] + row[1] * turning[1] + row[2] * turning[2]);
        let (gyro, weight) = (cross(turning, spin), cross(moment, field));
        let mass = T::splat(constants.mass);
        let pushed = [burden.force[0], T::zero(), burden.force[1]];
        let mut force = [T::zero(); 6];
        for i in 0..3 {
            force[i] = mass * field[i] - inward[i] - two * coriolis[i] + pushed[i];
            force[3 + i] = weight[i] - gyro[i] + burden.torque[i];
        }
        Self {
            moment,
            inertia,
            force,
        }
    }

    /// The inertia matrix of the trunk's rows.
    pub(crate) fn matrix(&self, mass: f64) -> [[T; 6]; 6] {
        let mut m = [[T::zero(); 6]; 6];
        let [x, y, z] = self.moment;
        let zero = T::zero();
        // −[S]×: the force of ω̇ × S.
        let skew = [[zero, z, -y], [-z, zero, x], [y, -x, zero]];
        for i in 0..3 {
            m[i][i] = T::splat(mass);
            for j in 0..3 {
                m[i][3 + j] = skew[i][j];
                m[3 + j][i] = skew[i][j];
                m[3 + i][3 + j] = self.inertia[i][j];
            }
        }
        m
    }
}

/// Sums a burden over the lanes.
pub(crate) fn summed<R: Real>(burden: &Burden<R>) -> Burden<R::Sum> {
    Burden {
        moment: burden.moment.map(R::sum),
        spread: burden.spread.map(R::sum),
        drift: burden.drift.map(R::sum),
        force: burden.force.map(R::sum),
        torque: burden.torque.map(R::sum),
    }
}

/// The force on the trunk that is left where the links accelerate so against it: F − Σ C θ̈.
#[inline(always)]
pub(crate) fn reduced<R: Real, const N: usize>(
    mut force: Spatial<R::Sum>,
    carried: &Carried<R, N>,
    relative: &[R; N],
) -> Spatial<R::Sum> {
    for (a, &row) in COUPLED.iter().enumerate() {
        let mut pull = R::zero();
        for i in 0..N {
            pull += carried.columns[i][a] * relative[i];
        }
        force[row] -= pull.sum();
    }
    force
}

/// The trunk's equations as they are left: S a = f, factored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Schur<T> {
    /// L and D of S = L D Lᵀ, D inverted; rows that do not move have a zero in place of the inverse.
    lower: [[T; 6]; 6],
    inverse: [T; 6],
    /// f.
    pub(crate) force: Spatial<T>,
}

impl<T: Real<Sum = T>> Schur<T> {
    /// Takes the legs out of the trunk's equations: S = M − Σ C Φ Cᵀ, f = F − Σ C (Φ τ + x).
    #[inline(always)]
    pub(crate) fn new<R: Real<Sum = T>, const N: usize>(
        constants: &TrunkConstants,
        trunk: &Trunk<T>,
        carried: &Carried<R, N>,
        give: &Give<R, N>,
    ) -> Self {
        let relative = give.accelerations(&carried.torques);
        let force = reduced(trunk.force, carried, &relative);
        Self::with(constants, trunk, carried, give, force)
    }

    /// The same for a force that is known: F − Σ C (Φ τ + x), or one that is to follow.
    #[inline(always)]
    pub(crate) fn with<R: Real<Sum = T>, const N: usize>(
        constants: &TrunkConstants,
        trunk: &Trunk<T>,
        carried: &Carried<R, N>,
        give: &Give<R, N>,
        force: Spatial<T>,
    ) -> Self {
        let mut matrix = trunk.matrix(constants.mass);
        // Φ Cᵀ
        let mut moved = [[R::zero(); 5]; N];
        for i in 0..N {
            for j in 0..N {
                for (m, c) in moved[i].iter_mut().zip(&carried.columns[j]) {
                    *m += give.mobility[i][j] * *c;
                }
            }
        }
        for (a, &row) in COUPLED.iter().enumerate() {
            for (b, &column) in COUPLED.iter().enumerate().take(a + 1) {
                let mut sum = R::zero();
                for i in 0..N {
                    sum += carried.columns[i][a] * moved[i][b];
                }
                matrix[row][column] -= sum.sum();
            }
        }
        Self::factored(matrix, force, constants.moves)
    }

    #[inline(always)]
    fn factored(mut a: [[T; 6]; 6], force: Spatial<T>, moves: [bool; 6]) -> Self {
        let mut inverse = [T::zero(); 6];
        for k in 0..6 {
            if !moves[k] {
                for row in a.iter_mut().skip(k + 1) {
                    row[k] = T::zero();
                }
                continue;
            }
            inverse[k] = T::splat(1.0) / a[k][k];
            for i in k + 1..6 {
                let factor = a[i][k] * inverse[k];
                for j in k + 1..=i {
                    let upper = a[j][k];
                    a[i][j] -= factor * upper;
                }
            }
            for row in a.iter_mut().skip(k + 1) {
                row[k] = row[k] * inverse[k];
            }
        }
        Self {
            lower: a,
            inverse,
            force,
        }
    }

    /// S⁻¹ b.
    #[inline(always)]
    pub(crate) fn solve(&self, mut b: Spatial<T>) -> Spatial<T> {
        for i in 0..6 {
            for j in 0..i {
                let known = b[j];
                b[i] -= self.lower[i][j] * known;
            }
        }
        for i in (0..6).rev() {
            b[i] = b[i] * self.inverse[i];
            for j in i + 1..6 {
                let known = b[j];
                b[i] -= self.lower[j][i] * known;
            }
        }
        b
    }
}
