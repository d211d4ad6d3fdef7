//! Legs that abduct: inertia and force of each leg in the frame that carries it, elimination of
//! the joint, and the equations of the trunk.
//!
//! With the links eliminated, a leg resists an acceleration A of its frame, about whose first axis
//! the joint turns, by the wrench W = M A − Q. The joint's row of it is the torque τ of drive,
//! stops and friction: an acceleration α̈ of the joint is imposed, or follows from
//!
//! ```text
//! (M₄₄ + I) α̈ = τ + Q₄ − M₄ A
//! ```
//!
//! with the inertia I of the drive. The sums of M and Q over the legs, in trunk axes, are added to
//! the equations of the trunk.

use twinrig_compliant::frame::cross;
use twinrig_compliant::lanes::Lanes;
use twinrig_compliant::{LegFrame, TrunkMotion};
use twinrig_legged::Base;

use super::elimination::PlaneShare;
use super::model::CompliantModel;
use super::trunk::times;

/// Inertia M of a leg and the force and torque Q that it needs no acceleration for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegBody<L> {
    /// Blocks of M; symmetric ones row by row up to the diagonal.
    linear: [L; 6],
    coupling: [[L; 3]; 3],
    angular: [L; 6],
    force: [L; 3],
    torque: [L; 3],
}

/// Terms of a leg beside its share of the plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OffPlane<L> {
    /// Lateral force \[N\], and torques about the axes of roll and yaw in the plane \[N·m\].
    pub(crate) lateral: L,
    pub(crate) roll: L,
    pub(crate) yaw: L,
    /// First moments of the masses, forward and up \[kg·m\], and second: Σ m x², Σ m z², Σ m x z
    /// \[kg·m²\].
    pub(crate) moment: [L; 2],
    pub(crate) spread: [L; 3],
}

/// Joint of a leg: frame that carries the leg, and drive.
#[derive(Clone, Copy)]
pub(crate) struct LegJoint<L: Lanes> {
    pub(crate) frame: LegFrame<L>,
    pub(crate) drive: JointDrive<L>,
}

/// Drive of the joints.
#[derive(Clone, Copy)]
pub(crate) struct JointDrive<L: Lanes> {
    /// Imposed acceleration \[rad/s²\].
    pub(crate) acceleration: L,
    /// Torque of joints that turn under one, and which do.
    pub(crate) torque: L,
    pub(crate) turning: Option<L::Mask>,
    /// Torque of stops and friction \[N·m\].
    pub(crate) resistance: L,
    /// Inertia of the drives \[kg·m²\].
    pub(crate) inertia: L,
}

/// Acceleration of a joint \[rad/s²\], and torque of its drive on the leg \[N·m\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointMotion<L> {
    pub(crate) acceleration: L,
    pub(crate) torque: L,
}

/// Row of a joint, kept from its elimination.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointRow<L> {
    row: [L; 6],
    torque: L,
    /// 1/(M₄₄ + I) of joints that turn under a torque, zero of the others.
    per: L,
}

impl<L: Lanes> LegBody<L> {
    /// Composes the inertia and the force of a leg under the field \[m/s²\] of its frame.
    #[inline(always)]
    ///
    /// The plane is `beside` the origin of the frame \[m\].
    pub(crate) fn new(
        (mass, beside): (L, L),
        share: &PlaneShare<L>,
        leg: &OffPlane<L>,
        frame: &LegFrame<L>,
    ) -> Self {
        let [xx, zx, zz, px, pz, pp] = share.matrix;
        let [fx, fz, pitch] = share.force;
        let [sx, sz] = leg.moment;
        let [spread_xx, spread_zz, spread_xz] = leg.spread;
        let (bxx, bzx, bzz) = (beside * xx, beside * zx, beside * zz);
        let zero = xx.zero();
        let sy = mass * beside;
        let [gx, gy, gz] = frame.field;
        let [about_y, about_z] = frame.swing;
        let mut body = Self {
            linear: [xx, zero, mass, zx, zero, zz],
            coupling: [[bzx, px, -bxx], [-sz, zero, sx], [bzz, pz, -bzx]],
            angular: [
                beside * bzz + spread_zz,
                beside * pz,
                pp,
                -(beside * bzx + spread_xz),
                -(beside * px),
                beside * bxx + spread_xx,
            ],
            force: [fx + mass * gx, leg.lateral + mass * gy, fz + mass * gz],
            torque: [
                leg.roll + beside * fz + (sy * gz - sz * gy),
                pitch + (sz * gx - sx * gz),
                leg.yaw - beside * fx + (sx * gy - sy * gx),
            ],
        };
        let [_, yx, yy, zx, zy, zz] = body.angular;
        for i in 0..3 {
            let [_, by_y, by_z] = body.coupling[i];
            body.force[i] -= by_y * about_y + by_z * about_z;
        }
        for (torque, (by_y, by_z)) in body.torque.iter_mut().zip([(yx, zx), (yy, zy), (zy, zz)]) {
            *torque -= by_y * about_y + by_z * about_z;
        }
        body
    }

    /// Moves the imposed acceleration of the joint to the right-hand sides, or eliminates it.
    #[inline(always)]
    pub(crate) fn eliminate(&mut self, drive: &JointDrive<L>) -> JointRow<L> {
        let [[x, ..], [y, ..], [z, ..]] = self.coupling;
        let [roll, pitch, _, yaw, ..] = self.angular;
        let (row, torque) = ([x, y, z, roll, pitch, yaw], self.torque[0]);
        let zero = x.zero();
        let Some(turning) = drive.turning else {
            self.drive(&row, drive.acceleration);
            let per = zero;
            return JointRow { row, torque, per };
        };
        let per = (roll + drive.inertia).reciprocal().or(turning, zero);
        let imposed = zero.or(turning, drive.acceleration);
        self.drive(
            &row,
            imposed + per * (drive.torque + drive.resistance + torque),
        );
        let mut scaled = row;
        for entry in &mut scaled {
            *entry = *entry * per;
        }
        let mut entry = 0;
        for a in 0..3 {
            for b in 0..=a {
                self.linear[entry] -= scaled[a] * row[b];
                self.angular[entry] -= scaled[3 + a] * row[3 + b];
                entry += 1;
            }
            for b in 0..3 {
                self.coupling[a][b] -= scaled[a] * row[3 + b];
            }
        }
        JointRow { row, torque, per }
    }

    /// Subtracts the wrench of an acceleration of the joint.
    #[inline(always)]
    fn drive(&mut self, row: &[L; 6], acceleration: L) {
        for i in 0..3 {
            self.force[i] -= row[i] * acceleration;
            self.torque[i] -= row[3 + i] * acceleration;
        }
    }

    /// Returns the sums over the legs in trunk axes, about the origin of the trunk.
    #[inline(always)]
    pub(crate) fn into_trunk(self, frame: &LegFrame<L>) -> SpatialSystem {
        let [left, up] = frame.axis;
        let linear = frame.tensor_into_trunk(self.linear);
        let mut coupling = self.coupling;
        // The first axis of rows and columns is that of the rotation.
        for row in &mut coupling {
            *row = frame.into_trunk(*row);
        }
        for j in 0..3 {
            let column = frame.into_trunk([coupling[0][j], coupling[1][j], coupling[2][j]]);
            [coupling[0][j], coupling[1][j], coupling[2][j]] = column;
        }
        let mut angular = frame.tensor_into_trunk(self.angular);
        let [force, torque] = frame.wrench_into_trunk(self.force, self.torque);
        // The velocity of the axis is v + ω × a.
        let [xx, yx, yy, zx, zy, zz] = linear;
        let moved = [[xx, yx, zx], [yx, yy, zy], [zx, zy, zz]];
        let about = |[b0, b1, b2]: [[L; 3]; 3], i: usize, j: usize| match i {
            0 => left * b2[j] - up * b1[j],
            1 => up * b0[j],
            _ => -(left * b0[j]),
        };
        let before = coupling;
        for i in 0..3 {
            let [x, y, z] = moved[i];
            coupling[i][0] += left * z - up * y;
            coupling[i][1] += up * x;
            coupling[i][2] -= left * x;
        }
        let mut entry = 0;
        for i in 0..3 {
            for j in 0..=i {
                angular[entry] += about(coupling, i, j) + about(before, j, i);
                entry += 1;
            }
        }
        SpatialSystem::sum(&linear, &coupling, &angular, force, torque)
    }
}

impl<L: Lanes> JointRow<L> {
    /// Returns the motion of the joint, at the acceleration of the frame without it, whose part
    /// from the rotation of the frame is in the force already.
    #[inline(always)]
    pub(crate) fn motion(&self, drive: &JointDrive<L>, [a, b]: [[L; 3]; 2]) -> JointMotion<L> {
        let row = &self.row;
        let linear = row[0] * a[0] + row[1] * a[1] + row[2] * a[2];
        let pulled = linear + (row[3] * b[0] + row[4] * b[1] + row[5] * b[2]);
        let free = self.per * (drive.torque + drive.resistance + self.torque - pulled);
        let acceleration = match drive.turning {
            Some(turning) => free.or(turning, drive.acceleration),
            None => drive.acceleration,
        };
        JointMotion {
            acceleration,
            torque: pulled + row[3] * acceleration - self.torque - drive.resistance,
        }
    }
}

/// Equations of the trunk: a symmetric matrix of linear and angular acceleration, and force and
/// torque.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SpatialSystem {
    /// Row by row up to the diagonal.
    pub(crate) linear: [f64; 6],
    pub(crate) coupling: [[f64; 3]; 3],
    pub(crate) angular: [f64; 6],
    pub(crate) force: [f64; 3],
    pub(crate) torque: [f64; 3],
}

impl SpatialSystem {
    /// Adds up the lanes.
    #[inline(always)]
    fn sum<L: Lanes>(
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

    /// Adds the trunk and its payloads, under gravity.
    pub(crate) fn add_trunk<const N: usize, const A: usize>(
        &mut self,
        model: &CompliantModel<N, A>,
        trunk: &TrunkMotion,
    ) {
        let (mass, field, turning) = (model.trunk_mass, trunk.field, trunk.turning);
        let mut inertia = [[0.0; 3]; 3];
        for i in 0..3 {
            inertia[i][i] = model.inertia[i];
        }
        for diagonal in [0, 2, 5] {
            self.linear[diagonal] += mass;
        }
        for i in 0..3 {
            self.force[i] += mass * field[i];
        }
        if let Some(payload) = &model.payload {
            let [x, y, z] = payload.moment;
            let moment = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
            let inward = cross(turning, cross(turning, payload.moment));
            let weight = cross(payload.moment, field);
            for (i, row) in payload.inertia().into_iter().enumerate() {
                for (j, part) in row.into_iter().enumerate() {
                    inertia[i][j] += part;
                    self.coupling[i][j] += moment[i][j];
                }
                self.force[i] -= inward[i];
                self.torque[i] += weight[i];
            }
        }
        let gyro = cross(turning, times(&inertia, turning));
        let mut entry = 0;
        for i in 0..3 {
            for j in 0..=i {
                self.angular[entry] += inertia[i][j];
                entry += 1;
            }
            self.torque[i] -= gyro[i];
        }
    }

    /// Adds a force and a torque on the trunk.
    pub(crate) fn push(&mut self, push: [f64; 6]) {
        for i in 0..3 {
            self.force[i] += push[i];
            self.torque[i] += push[3 + i];
        }
    }

    /// Returns the acceleration of the trunk, linear then angular. By L D Lᵀ, from the first
    /// component to the last.
    pub(crate) fn solve(&self, base: Base) -> [f64; 6] {
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
