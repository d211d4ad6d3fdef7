//! Equations of a trunk that carries legs.

use twinrig_legged::Base;

use crate::frame::cross;
use crate::lanes::Lanes;

/// Equations of the trunk: a symmetric matrix of linear and angular acceleration, and force and
/// torque.
#[derive(Debug, Clone, Copy)]
pub struct SpatialSystem {
    /// Blocks; symmetric ones row by row up to the diagonal.
    linear: [f64; 6],
    coupling: [[f64; 3]; 3],
    angular: [f64; 6],
    force: [f64; 3],
    torque: [f64; 3],
}

impl SpatialSystem {
    /// Adds up the lanes.
    #[inline(always)]
    pub(super) fn sum<L: Lanes>(
        linear: &[L; 6],
        coupling: &[[L; 3]; 3],
        angular: &[L; 6],
        force: [L; 3],
        torque: [L; 3],
    ) -> Self {
        let zero = linear[0].zero();
        let [a, b, c, d, e, f] = *linear;
        let [xx, yx, yy, zx] = L::sums([a, b, c, d]).quad().0;
        let [zy, zz, roll, pitch] = L::sums([e, f, torque[0], torque[1]]).quad().0;
        let row = |row: [L; 3], fourth: L| L::sums([row[0], row[1], row[2], fourth]).quad().0;
        let [p, q, r] = [0, 1, 2].map(|i| row(coupling[i], force[i]));
        let [a, b, c, d, e, f] = *angular;
        let [axx, ayx, ayy, azx] = L::sums([a, b, c, d]).quad().0;
        let [azy, azz, yaw, _] = L::sums([e, f, torque[2], zero]).quad().0;
        Self {
            linear: [xx, yx, yy, zx, zy, zz],
            coupling: [p, q, r].map(|[a, b, c, _]| [a, b, c]),
            angular: [axx, ayx, ayy, azx, azy, azz],
            force: [p[3], q[3], r[3]],
            torque: [roll, pitch, yaw],
        }
    }

    /// Adds a body without motion relative to the trunk: its inertia about its own origin, which is
    /// that of the trunk, its first moment \[kg·m\], and the forces of `field` \[m/s²\] and of the
    /// rotation of the trunk.
    pub fn add_trunk(
        &mut self,
        (mass, moment, inertia): (f64, [f64; 3], &[[f64; 3]; 3]),
        field: [f64; 3],
        turning: [f64; 3],
    ) {
        let [x, y, z] = moment;
        let coupling = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
        let inward = cross(turning, cross(turning, moment));
        let weight = cross(moment, field);
        let spin = inertia.map(|[x, y, z]| x * turning[0] + y * turning[1] + z * turning[2]);
        let gyro = cross(turning, spin);
        let mut entry = 0;
        for i in 0..3 {
            for j in 0..3 {
                self.coupling[i][j] += coupling[i][j];
            }
            for j in 0..=i {
                self.linear[entry] += if i == j { mass } else { 0.0 };
                self.angular[entry] += inertia[i][j];
                entry += 1;
            }
            self.force[i] += mass * field[i] - inward[i];
            self.torque[i] += weight[i] - gyro[i];
        }
    }

    /// Adds a force and a torque on the trunk.
    pub fn push(&mut self, push: [f64; 6]) {
        for i in 0..3 {
            self.force[i] += push[i];
            self.torque[i] += push[3 + i];
        }
    }

    /// Returns the acceleration of the trunk, linear then angular. By L D Lᵀ, from the first
    /// component to the last.
    pub fn solve(&self, base: Base) -> [f64; 6] {
        let is_free = match base {
            Base::Free => [true; 6],
            Base::Planar => [true, false, true, false, true, false],
            Base::Fixed => return [0.0; 6],
        };
        let (linear, coupling, angular) = (&self.linear, &self.coupling, &self.angular);
        let entry = |i: usize, j: usize| match (i < 3, j < 3) {
            (true, true) => linear[i * (i + 1) / 2 + j],
            (false, true) => coupling[j][i - 3],
            _ => angular[(i - 3) * (i - 2) / 2 + j - 3],
        };
        let mut matrix = [[0.0; 6]; 6];
        let mut solution = [0.0; 6];
        for i in 0..6 {
            for j in 0..=i {
                if is_free[i] && is_free[j] {
                    matrix[i][j] = entry(i, j);
                } else if i == j {
                    matrix[i][j] = 1.0;
                }
            }
            if is_free[i] {
                solution[i] = if i < 3 {
                    self.force[i]
                } else {
                    self.torque[i - 3]
                };
            }
        }
        let mut pivots = [0.0; 6];
        for i in 0..6 {
            let mut scaled = [0.0; 6];
            for j in 0..i {
                let mut entry = matrix[i][j];
                for k in 0..j {
                    entry -= scaled[k] * matrix[j][k];
                }
                scaled[j] = entry;
                matrix[i][j] = entry * pivots[j];
            }
            let mut pivot = matrix[i][i];
            for j in 0..i {
                pivot -= scaled[j] * matrix[i][j];
                solution[i] -= matrix[i][j] * solution[j];
            }
            pivots[i] = 1.0 / pivot;
        }
        for i in (0..6).rev() {
            solution[i] *= pivots[i];
            for k in i + 1..6 {
                solution[i] -= matrix[k][i] * solution[k];
            }
        }
        solution
    }
}
