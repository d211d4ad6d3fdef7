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
        let [[bxx, bxy, bxz], [byx, byy, byz], [bzx, bzy, bzz]] = *coupling;
        let x = L::sums([bxx, bxy, bxz, force[0]]).quad().0;
        let y = L::sums([byx, byy, byz, force[1]]).quad().0;
        let z = L::sums([bzx, bzy, bzz, force[2]]).quad().0;
        let [a, b, c, d, e, f] = *angular;
        let [axx, ayx, ayy, azx] = L::sums([a, b, c, d]).quad().0;
        let [azy, azz, yaw, _] = L::sums([e, f, torque[2], zero]).quad().0;
        Self {
            linear: [xx, yx, yy, zx, zy, zz],
            coupling: [[x[0], x[1], x[2]], [y[0], y[1], y[2]], [z[0], z[1], z[2]]],
            angular: [axx, ayx, ayy, azx, azy, azz],
            force: [x[3], y[3], z[3]],
            torque: [roll, pitch, yaw],
        }
    }

    /// Adds a body without motion relative to the trunk: its mass \[kg\], its first moment
    /// \[kg·m\] and its inertia about the origin of the trunk \[kg·m²\], row by row up to the
    /// diagonal, and the forces of `field` \[m/s²\] and of the rotation of the trunk.
    #[inline(always)]
    pub fn add_trunk(
        &mut self,
        (mass, moment, inertia): (f64, [f64; 3], [f64; 6]),
        field: [f64; 3],
        turning: [f64; 3],
    ) {
        let [x, y, z] = moment;
        for diagonal in [0, 2, 5] {
            self.linear[diagonal] += mass;
        }
        for (entry, part) in self.angular.iter_mut().zip(inertia) {
            *entry += part;
        }
        let [along, left, up] = &mut self.coupling;
        (along[1], along[2]) = (along[1] + z, along[2] - y);
        (left[0], left[2]) = (left[0] - z, left[2] + x);
        (up[0], up[1]) = (up[0] + y, up[1] - x);
        let inward = cross(turning, cross(turning, moment));
        let weight = cross(moment, field);
        let gyro = cross(turning, times(&inertia, turning));
        for i in 0..3 {
            self.force[i] += mass * field[i] - inward[i];
            self.torque[i] += weight[i] - gyro[i];
        }
    }

    /// Adds a force and a torque on the trunk.
    #[inline(always)]
    pub fn push(&mut self, push: [f64; 6]) {
        for i in 0..3 {
            self.force[i] += push[i];
            self.torque[i] += push[3 + i];
        }
    }

    /// Returns the acceleration of the trunk, linear then angular: the linear ones are eliminated,
    /// and both blocks inverted by cofactors.
    #[inline(always)]
    pub fn solve(&self, base: Base) -> [f64; 6] {
        match base {
            Base::Free => self.solved(),
            Base::Planar => self.in_plane().solved(),
            Base::Fixed => [0.0; 6],
        }
    }

    #[inline(always)]
    fn solved(&self) -> [f64; 6] {
        let (inverse, [x, y, z]) = (inverse(&self.linear), self.coupling);
        // Motion per unit of rotation.
        let roll = times(&inverse, [x[0], y[0], z[0]]);
        let pitch = times(&inverse, [x[1], y[1], z[1]]);
        let yaw = times(&inverse, [x[2], y[2], z[2]]);
        let less =
            |axis: usize, per: [f64; 3]| x[axis] * per[0] + y[axis] * per[1] + z[axis] * per[2];
        let [rr, pr, pp, yr, yp, yy] = self.angular;
        let rest = [
            rr - less(0, roll),
            pr - less(1, roll),
            pp - less(1, pitch),
            yr - less(2, roll),
            yp - less(2, pitch),
            yy - less(2, yaw),
        ];
        let moved = times(&inverse, self.force);
        let torque = [
            self.torque[0] - less(0, moved),
            self.torque[1] - less(1, moved),
            self.torque[2] - less(2, moved),
        ];
        let [a, b, c] = times(&self::inverse(&rest), torque);
        [
            moved[0] - (roll[0] * a + pitch[0] * b + yaw[0] * c),
            moved[1] - (roll[1] * a + pitch[1] * b + yaw[1] * c),
            moved[2] - (roll[2] * a + pitch[2] * b + yaw[2] * c),
            a,
            b,
            c,
        ]
    }

    /// Returns the same for a trunk that neither sways nor rolls nor yaws.
    fn in_plane(&self) -> Self {
        let [xx, _, _, zx, _, zz] = self.linear;
        Self {
            linear: [xx, 0.0, 1.0, zx, 0.0, zz],
            coupling: [
                [0.0, self.coupling[0][1], 0.0],
                [0.0; 3],
                [0.0, self.coupling[2][1], 0.0],
            ],
            angular: [1.0, 0.0, self.angular[2], 0.0, 0.0, 1.0],
            force: [self.force[0], 0.0, self.force[2]],
            torque: [0.0, self.torque[1], 0.0],
        }
    }
}

/// Returns a symmetric matrix times a vector.
#[inline(always)]
fn times([xx, yx, yy, zx, zy, zz]: &[f64; 6], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        xx * x + yx * y + zx * z,
        yx * x + yy * y + zy * z,
        zx * x + zy * y + zz * z,
    ]
}

/// Returns the inverse of a symmetric matrix.
#[inline(always)]
fn inverse([xx, yx, yy, zx, zy, zz]: &[f64; 6]) -> [f64; 6] {
    let (a, b, c) = (yy * zz - zy * zy, zx * zy - yx * zz, yx * zy - yy * zx);
    let per = 1.0 / (xx * a + yx * b + zx * c);
    [
        a * per,
        b * per,
        (xx * zz - zx * zx) * per,
        c * per,
        (yx * zx - xx * zy) * per,
        (xx * yy - yx * yx) * per,
    ]
}
