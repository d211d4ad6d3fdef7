//! Legs in the frames that carry them: inertia and force, and elimination of the joint.
//!
//! A leg resists an acceleration A of its frame, about whose first axis the joint turns, by the
//! wrench W = M A − Q. The joint's row of it is the torque τ of drive, stops and friction: an
//! acceleration α̈ of the joint is imposed, or follows from
//!
//! ```text
//! (M₄₄ + I) α̈ = τ + Q₄ − M₄ A
//! ```
//!
//! with the inertia I of the drive. The sums of M and Q over the legs, in trunk axes, are added to
//! the equations of the trunk.

use super::drive::{JointDrive, JointMotion};
use super::frame::LegFrame;
use super::spatial::SpatialSystem;
use crate::lanes::Lanes;

/// Inertia M of a leg, and the force and torque Q for which it needs no acceleration, in leg axes
/// about the origin of the frame.
#[derive(Debug, Clone, Copy)]
pub struct LegBody<L> {
    /// Blocks of M; symmetric ones row by row up to the diagonal.
    pub linear: [L; 6],
    /// See [`Self::linear`].
    pub coupling: [[L; 3]; 3],
    /// See [`Self::linear`].
    pub angular: [L; 6],
    /// Force \[N\].
    pub force: [L; 3],
    /// Torque \[N·m\].
    pub torque: [L; 3],
}

/// Row of a joint, kept from its elimination.
#[derive(Debug, Clone, Copy)]
pub struct JointRow<L> {
    row: [L; 6],
    torque: L,
    /// 1/(M₄₄ + I) of joints that turn under a torque, zero of the others.
    per: L,
}

impl<L: Lanes> LegBody<L> {
    /// Subtracts the wrench of the angular acceleration that the frame has without those of trunk
    /// and joint, about its second and third axis \[rad/s²\].
    #[inline(always)]
    #[must_use]
    pub fn swung(mut self, [about_y, about_z]: [L; 2]) -> Self {
        let [_, yx, yy, zx, zy, zz] = self.angular;
        for (force, [_, by_y, by_z]) in self.force.iter_mut().zip(self.coupling) {
            *force -= by_y * about_y + by_z * about_z;
        }
        let entries = [(yx, zx), (yy, zy), (zy, zz)];
        for (torque, (by_y, by_z)) in self.torque.iter_mut().zip(entries) {
            *torque -= by_y * about_y + by_z * about_z;
        }
        self
    }

    /// Moves the imposed acceleration of the joint to the right-hand sides, or eliminates it.
    #[inline(always)]
    pub fn eliminate(&mut self, drive: &JointDrive<L>) -> JointRow<L> {
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
    pub fn into_trunk(self, frame: &LegFrame<L>) -> SpatialSystem {
        let [left, up] = frame.axis;
        let linear = frame.tensor_into_trunk(self.linear);
        // Both rows and columns turn.
        let [x, y, z] = self.coupling;
        let (x, y, z) = (
            frame.into_trunk(x),
            frame.into_trunk(y),
            frame.into_trunk(z),
        );
        let first = frame.into_trunk([x[0], y[0], z[0]]);
        let second = frame.into_trunk([x[1], y[1], z[1]]);
        let third = frame.into_trunk([x[2], y[2], z[2]]);
        let x = [first[0], second[0], third[0]];
        let y = [first[1], second[1], third[1]];
        let z = [first[2], second[2], third[2]];
        // The velocity of the axis is v + ω × a.
        let [xx, yx, yy, zx, zy, zz] = linear;
        let moved_x = [
            x[0] + (left * zx - up * yx),
            x[1] + up * xx,
            x[2] - left * xx,
        ];
        let moved_y = [
            y[0] + (left * zy - up * yy),
            y[1] + up * yx,
            y[2] - left * yx,
        ];
        let moved_z = [
            z[0] + (left * zz - up * zy),
            z[1] + up * zx,
            z[2] - left * zx,
        ];
        let [rr, pr, pp, yr, yp, yaw] = frame.tensor_into_trunk(self.angular);
        let angular = [
            rr + left * (moved_z[0] + z[0]) - up * (moved_y[0] + y[0]),
            pr + up * moved_x[0] + (left * z[1] - up * y[1]),
            pp + up * (moved_x[1] + x[1]),
            yr - left * moved_x[0] + (left * z[2] - up * y[2]),
            yp - left * moved_x[1] + up * x[2],
            yaw - left * (moved_x[2] + x[2]),
        ];
        let coupling = [moved_x, moved_y, moved_z];
        let [force, torque] = frame.wrench_into_trunk(self.force, self.torque);
        SpatialSystem::sum(&linear, &coupling, &angular, force, torque)
    }
}

impl<L: Lanes> JointRow<L> {
    /// Returns the motion of the joint, at the acceleration of the frame without it, whose part
    /// from the rotation of the frame is in the force already.
    #[inline(always)]
    pub fn motion(&self, drive: &JointDrive<L>, [a, b]: [[L; 3]; 2]) -> JointMotion<L> {
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
