//! Equations of the trunk, with the legs eliminated.

use twinrig_compliant::frame::cross;
use twinrig_legged::Base;
use twinrig_robot::Payload;

/// Returns a matrix times a vector.
pub(crate) fn times(matrix: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * x + row[1] * y + row[2] * z)
}

/// Equations of the trunk: blocks of a symmetric matrix, and force and torque.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkSystem {
    /// Block of forward and up: forward, mixed, up.
    pub(crate) plane: [f64; 3],
    /// Coupling of forward and of up to roll, pitch and yaw.
    pub(crate) ahead: [f64; 3],
    pub(crate) up: [f64; 3],
    /// Coupling of the lateral direction to roll and yaw: −Σ m z and Σ m x.
    pub(crate) lateral: [f64; 2],
    /// Block of the rotations, row by row up to the diagonal.
    pub(crate) rotation: [f64; 6],
    /// Total mass.
    pub(crate) mass: f64,
    pub(crate) force: [f64; 6],
}

impl TrunkSystem {
    /// Adds payloads, whose mass is that of the trunk already; `field` is g − ω × v.
    ///
    /// With S = Σ m r and the inertia J of the payloads about the trunk's centre of mass, the force
    /// on it is −ω × (ω × S), the torque S × (g − ω × v) − ω × J ω; ω̇ × S and S × v̇ couple the
    /// translation with the rotation.
    pub(crate) fn carry(&mut self, payload: &Payload, field: [f64; 3], turning: [f64; 3]) {
        let [x, y, z] = payload.moment;
        let add = |to: &mut [f64; 3], part: [f64; 3]| {
            to.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        };
        add(&mut self.ahead, [0.0, z, -y]);
        add(&mut self.up, [y, -x, 0.0]);
        self.lateral[0] -= z;
        self.lateral[1] += x;
        let inertia = payload.inertia();
        let [[xx, ..], [xy, yy, _], [xz, yz, zz]] = inertia;
        let entries = self.rotation.iter_mut().zip([xx, xy, yy, xz, yz, zz]);
        entries.for_each(|(sum, part)| *sum += part);
        let inward = cross(turning, cross(turning, payload.moment));
        let weight = cross(payload.moment, field);
        let gyro = cross(turning, times(&inertia, turning));
        for i in 0..3 {
            self.force[i] -= inward[i];
            self.force[3 + i] += weight[i] - gyro[i];
        }
    }

    /// Returns the acceleration of the trunk, linear then angular.
    ///
    /// The lateral row and the block of forward and up are eliminated, and the rotations are solved
    /// by cofactors.
    #[inline(always)]
    pub(crate) fn solve(&self, base: Base) -> [f64; 6] {
        if base == Base::Fixed {
            return [0.0; 6];
        }
        let mass = self.mass;
        let [xx, xz, zz] = self.plane;
        let [fx, mut fy, fz, mut roll, pitch, mut yaw] = self.force;
        let (mut bx, mut bz) = (self.ahead, self.up);
        let [mut y_roll, mut y_yaw] = self.lateral;
        let [mut rr, mut rp, pp, mut ry, mut py, mut yy] = self.rotation;
        if base == Base::Planar {
            (fy, roll, yaw, y_roll, y_yaw) = (0.0, 0.0, 0.0, 0.0, 0.0);
            (rr, rp, ry, py, yy) = (1.0, 0.0, 0.0, 0.0, 1.0);
            (bx, bz) = ([0.0, bx[1], 0.0], [0.0, bz[1], 0.0]);
        }
        let per = 1.0 / (xx * zz - xz * xz);
        let per_mass = 1.0 / mass;
        // Inverse of the block times its columns: the motion per unit of rotation.
        let (mut kx, mut kz) = (bx, bz);
        for i in 0..3 {
            kx[i] = (zz * bx[i] - xz * bz[i]) * per;
            kz[i] = (xx * bz[i] - xz * bx[i]) * per;
        }
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
