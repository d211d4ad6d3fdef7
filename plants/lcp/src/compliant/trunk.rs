//! Equations of the trunk, with the legs eliminated.

use twinrig_legged::Base;

/// Sums over the legs: entries of the matrix of the coupled rows (forward, up, roll, pitch, yaw; row
/// by row up to the diagonal), first moment of the masses, and force and torque.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkSums {
    pub(crate) matrix: [f64; 15],
    /// Σ m x and Σ m z about the centre of mass of the trunk \[kg·m\].
    pub(crate) moment: [f64; 2],
    pub(crate) force: [f64; 6],
}

impl TrunkSums {
    /// Solves for the acceleration of the trunk, linear then angular, for the total mass.
    ///
    /// The lateral row couples to the rotations by the moment alone; it and the block of forward and
    /// up are eliminated, and the rotations are solved by cofactors.
    #[inline(always)]
    pub(crate) fn solve(&self, base: Base, mass: f64) -> [f64; 6] {
        let m = &self.matrix;
        let (xx, xz, zz) = (m[0] + mass, m[1], m[2] + mass);
        let [fx, mut fy, fz, mut roll, pitch, mut yaw] = self.force;
        // Rows of forward and up: columns of roll, pitch and yaw.
        let (mut bx, mut bz) = ([m[3], m[6], m[10]], [m[4], m[7], m[11]]);
        let [mut y_roll, mut y_yaw] = [-self.moment[1], self.moment[0]];
        let [mut rr, mut rp, pp, mut ry, mut py, mut yy] =
            [m[5], m[8], m[9], m[12], m[13], m[14]];
        if base == Base::Planar {
            (fy, roll, yaw, y_roll, y_yaw) = (0.0, 0.0, 0.0, 0.0, 0.0);
            (rr, rp, ry, py, yy) = (1.0, 0.0, 0.0, 0.0, 1.0);
            (bx, bz) = ([0.0, bx[1], 0.0], [0.0, bz[1], 0.0]);
        }
        let per = 1.0 / (xx * zz - xz * xz);
        let per_mass = 1.0 / mass;
        // Inverse of the block times its columns: the motion per unit of rotation.
        let kx: [f64; 3] = std::array::from_fn(|i| (zz * bx[i] - xz * bz[i]) * per);
        let kz: [f64; 3] = std::array::from_fn(|i| (xx * bz[i] - xz * bx[i]) * per);
        let (sx, sz) = ((zz * fx - xz * fz) * per, (xx * fz - xz * fx) * per);
        let less = |i: usize, j: usize| bx[i] * kx[j] + bz[i] * kz[j];
        rr -= less(0, 0) + y_roll * y_roll * per_mass;
        rp -= less(1, 0);
        let pp = pp - less(1, 1);
        ry -= less(2, 0) + y_yaw * y_roll * per_mass;
        py -= less(2, 1);
        yy -= less(2, 2) + y_yaw * y_yaw * per_mass;
        let turn = |i: usize| bx[i] * sx + bz[i] * sz;
        let roll = roll - turn(0) - y_roll * fy * per_mass;
        let pitch = pitch - turn(1);
        let yaw = yaw - turn(2) - y_yaw * fy * per_mass;
        let (c0, c1, c2) = (pp * yy - py * py, ry * py - rp * yy, rp * py - pp * ry);
        let per = 1.0 / (rr * c0 + rp * c1 + ry * c2);
        let (d1, d2, e2) = (rr * yy - ry * ry, rp * ry - rr * py, rr * pp - rp * rp);
        let w = [
            (c0 * roll + c1 * pitch + c2 * yaw) * per,
            (c1 * roll + d1 * pitch + d2 * yaw) * per,
            (c2 * roll + d2 * pitch + e2 * yaw) * per,
        ];
        [
            sx - (kx[0] * w[0] + kx[1] * w[1] + kx[2] * w[2]),
            (fy - y_roll * w[0] - y_yaw * w[2]) * per_mass,
            sz - (kz[0] * w[0] + kz[1] * w[1] + kz[2] * w[2]),
            w[0],
            w[1],
            w[2],
        ]
    }
}
