//! Equations of the trunk with the legs eliminated (Schur complement): six rows, for any number of
//! legs.

use twinrig_robot::Payload;

use crate::model::coupling::{COUPLED, LegContribution, LegCoupling};
use crate::model::elimination::LegMobility;
use crate::model::real::Real;

/// Spatial vector of the trunk: linear, then angular, trunk axes.
pub(crate) type Spatial<T> = [T; 6];

/// Constants of the trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkConstants {
    /// Mass of trunk, payloads and legs \[kg\].
    pub(crate) mass: f64,
    /// Principal moments of the trunk alone \[kg·m²\].
    pub(crate) inertia: [f64; 3],
    /// Payloads of the trunk.
    pub(crate) payload: Option<Payload>,
    /// Directions in which the trunk may move: forward, left, up, roll, pitch, yaw.
    pub(crate) moves: [bool; 6],
}

pub(crate) fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Trunk in one state, legs included.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trunk<T> {
    /// Σ m r of the legs.
    pub(crate) moment: [T; 3],
    /// Moments of inertia about the trunk's centre of mass, all masses, symmetric.
    pub(crate) inertia: [[T; 3]; 3],
    /// Force and torque on the trunk: gravity and velocity terms.
    pub(crate) force: Spatial<T>,
}

impl<T: Real<Sum = T>> Trunk<T> {
    /// Computes the inertia only, from the contributions of the legs summed over the lanes.
    pub(crate) fn unloaded(constants: &TrunkConstants, contribution: &LegContribution<T>) -> Self {
        let (mut moment, mut spread) = (contribution.moment, contribution.spread);
        if let Some(payload) = &constants.payload {
            let moments = moment.iter_mut().zip(&payload.moment);
            moments.for_each(|(sum, part)| *sum += T::splat(*part));
            let spreads = spread.iter_mut().zip(&payload.spread);
            spreads.for_each(|(sum, part)| *sum += T::splat(*part));
        }
        let [xx, yy, zz, xy, xz, yz] = spread;
        let trunk = constants.inertia.map(T::splat);
        Self {
            moment,
            inertia: [
                [trunk[0] + yy + zz, -xy, -xz],
                [-xy, trunk[1] + xx + zz, -yz],
                [-xz, -yz, trunk[2] + xx + yy],
            ],
            force: [T::zero(); 6],
        }
    }

    /// Computes inertia and forces. `field` is g − ω × v.
    pub(crate) fn new(
        constants: &TrunkConstants,
        contribution: &LegContribution<T>,
        turning: [T; 3],
        field: [T; 3],
    ) -> Self {
        let Self {
            moment, inertia, ..
        } = Self::unloaded(constants, contribution);
        let drift = [contribution.drift[0], T::zero(), contribution.drift[1]];
        let two = T::splat(2.0);
        let inward = cross(turning, cross(turning, moment));
        let coriolis = cross(turning, drift);
        let spin =
            inertia.map(|row| row[0] * turning[0] + row[1] * turning[1] + row[2] * turning[2]);
        let (gyro, weight) = (cross(turning, spin), cross(moment, field));
        let mass = T::splat(constants.mass);
        let leg_force = [contribution.force[0], T::zero(), contribution.force[1]];
        let mut force = [T::zero(); 6];
        for i in 0..3 {
            force[i] = mass * field[i] - inward[i] - two * coriolis[i] + leg_force[i];
            force[3 + i] = weight[i] - gyro[i] + contribution.torque[i];
        }
        Self {
            moment,
            inertia,
            force,
        }
    }

    /// Returns the inertia matrix of the trunk's rows.
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

/// Sums a contribution over the lanes.
pub(crate) fn summed<R: Real>(contribution: &LegContribution<R>) -> LegContribution<R::Sum> {
    LegContribution {
        moment: contribution.moment.map(R::sum),
        spread: contribution.spread.map(R::sum),
        drift: contribution.drift.map(R::sum),
        force: contribution.force.map(R::sum),
        torque: contribution.torque.map(R::sum),
    }
}

/// Returns the force on the trunk reduced by these relative accelerations of the links: F − Σ C θ̈.
#[inline(always)]
pub(crate) fn reduced<R: Real, const N: usize>(
    mut force: Spatial<R::Sum>,
    coupling: &LegCoupling<R, N>,
    relative: &[R; N],
) -> Spatial<R::Sum> {
    for (a, &row) in COUPLED.iter().enumerate() {
        let mut pull = R::zero();
        for i in 0..N {
            pull += coupling.columns[i][a] * relative[i];
        }
        force[row] -= pull.sum();
    }
    force
}

/// Reduced equations of the trunk: S a = f, factored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Schur<T> {
    /// L and inverse of D of S = L D Lᵀ; the inverse is zero in rows of fixed directions.
    lower: [[T; 6]; 6],
    inverse: [T; 6],
    /// f.
    pub(crate) force: Spatial<T>,
}

impl<T: Real<Sum = T>> Schur<T> {
    /// Eliminates the legs from the equations of the trunk: S = M − Σ C Φ Cᵀ, f = F − Σ C (Φ τ +
    /// x).
    #[inline(always)]
    pub(crate) fn new<R: Real<Sum = T>, const N: usize>(
        constants: &TrunkConstants,
        trunk: &Trunk<T>,
        coupling: &LegCoupling<R, N>,
        mobility: &LegMobility<R, N>,
    ) -> Self {
        let relative = mobility.accelerations(&coupling.torques);
        let force = reduced(trunk.force, coupling, &relative);
        Self::with(constants, trunk, coupling, mobility, force)
    }

    /// Does the same with a given force: F − Σ C (Φ τ + x), or a placeholder.
    #[inline(always)]
    pub(crate) fn with<R: Real<Sum = T>, const N: usize>(
        constants: &TrunkConstants,
        trunk: &Trunk<T>,
        coupling: &LegCoupling<R, N>,
        mobility: &LegMobility<R, N>,
        force: Spatial<T>,
    ) -> Self {
        let mut matrix = trunk.matrix(constants.mass);
        // Φ Cᵀ
        let mut moved = [[R::zero(); 5]; N];
        for i in 0..N {
            for j in 0..N {
                for (m, c) in moved[i].iter_mut().zip(&coupling.columns[j]) {
                    *m += mobility.matrix[i][j] * *c;
                }
            }
        }
        for (a, &row) in COUPLED.iter().enumerate() {
            for (b, &column) in COUPLED.iter().enumerate().take(a + 1) {
                let mut sum = R::zero();
                for i in 0..N {
                    sum += coupling.columns[i][a] * moved[i][b];
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

    /// Returns S⁻¹ b.
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
