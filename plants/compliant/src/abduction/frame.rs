//! Frames that carry legs.

use super::AbductionJoints;
use crate::ground::{Point, TrunkMotion, broadcast};
use crate::lanes::Lanes;

impl<L: Lanes> AbductionJoints<L> {
    /// Returns the frames that carry the legs, at these angles \[rad\] and rates \[rad/s\].
    #[inline(always)]
    pub fn frame(&self, angle: L, rate: L, trunk: &TrunkMotion) -> LegFrame<L> {
        let ([sine], [cosine]) = L::sin_cos([angle]);
        let ([y, z], zero) = (self.axis, angle.zero());
        let [wx, wy, wz] = trunk.turning;
        let [vx, vy, vz] = trunk.velocity;
        // ω × a, then ω × (ω × a).
        let around = [z * wy - y * wz, zero - z * wx, y * wx];
        let inward = [
            around[2] * wy - around[1] * wz,
            around[0] * wz - around[2] * wx,
            around[1] * wx - around[0] * wy,
        ];
        let turning = broadcast(zero, trunk.turning);
        let [fx, fy, fz] = broadcast(zero, trunk.field);
        let field = [fx - inward[0], fy - inward[1], fz - inward[2]];
        let mut frame = LegFrame {
            sine,
            cosine,
            axis: self.axis,
            velocity: [around[0] + vx, around[1] + vy, around[2] + vz],
            turning,
            field,
            swing: [zero; 2],
        };
        frame.velocity = frame.into_leg(frame.velocity);
        frame.field = frame.into_leg(frame.field);
        let [x, y, z] = frame.into_leg(turning);
        frame.turning = [x + rate, y, z];
        frame.swing = [rate * z, -(rate * y)];
        frame
    }
}

/// Frames that carry legs, whose origins lie on the axes of abduction.
#[derive(Debug, Clone, Copy)]
pub struct LegFrame<L> {
    sine: L,
    cosine: L,
    /// Left and up \[m\].
    pub axis: [L; 2],
    /// V and Ω, leg axes \[m/s, rad/s\].
    pub velocity: [L; 3],
    /// See [`Self::velocity`].
    pub turning: [L; 3],
    /// Rᵀ (g − ω × (v + ω × a)) \[m/s²\].
    pub field: [L; 3],
    /// Angular acceleration without those of trunk and joint, about the second and the third axis
    /// of the leg \[rad/s²\].
    pub swing: [L; 2],
}

impl<L: Lanes> LegFrame<L> {
    /// Transforms a vector from trunk to leg axes.
    #[inline(always)]
    #[must_use]
    pub fn into_leg(&self, [x, y, z]: [L; 3]) -> [L; 3] {
        [
            x,
            self.cosine * y + self.sine * z,
            self.cosine * z - self.sine * y,
        ]
    }

    /// Transforms a vector from leg to trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn into_trunk(&self, [x, y, z]: [L; 3]) -> [L; 3] {
        [
            x,
            self.cosine * y - self.sine * z,
            self.sine * y + self.cosine * z,
        ]
    }

    /// Transforms a symmetric matrix, row by row up to the diagonal, from leg to trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn tensor_into_trunk(&self, [xx, yx, yy, zx, zy, zz]: [L; 6]) -> [L; 6] {
        let (s, c) = (self.sine, self.cosine);
        let (difference, mixed) = (yy - zz, s * c);
        let shift = s * s * difference + (mixed + mixed) * zy;
        [
            xx,
            c * yx - s * zx,
            yy - shift,
            s * yx + c * zx,
            mixed * difference + (c * c - s * s) * zy,
            zz + shift,
        ]
    }

    /// Returns the velocity at a place that does not move within the leg, leg axes.
    #[inline(always)]
    #[must_use]
    pub fn carried(&self, [x, y, z]: [L; 3]) -> [L; 3] {
        let ([wx, wy, wz], [vx, vy, vz]) = (self.turning, self.velocity);
        [
            z * wy - y * wz + vx,
            x * wz - z * wx + vy,
            y * wx - x * wy + vz,
        ]
    }

    /// Transforms a place and a velocity in leg axes to those in trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn point_at(&self, place: [L; 3], velocity: [L; 3]) -> Point<L> {
        let ([x, y, z], [left, up]) = (self.into_trunk(place), self.axis);
        Point {
            place: [x, y + left, z + up],
            velocity: self.into_trunk(velocity),
        }
    }

    /// Transforms a point and its velocity within the leg, in leg axes, to those in trunk axes.
    #[inline(always)]
    #[must_use]
    pub fn point(&self, place: [L; 3], [u, w]: [L; 2]) -> Point<L> {
        let [vx, vy, vz] = self.carried(place);
        self.point_at(place, [u + vx, vy, w + vz])
    }

    /// Returns a force and a torque about the axis, in leg axes, as a force and a torque about the
    /// origin of the trunk in its axes.
    #[inline(always)]
    #[must_use]
    pub fn wrench_into_trunk(&self, force: [L; 3], torque: [L; 3]) -> [[L; 3]; 2] {
        let [fx, fy, fz] = self.into_trunk(force);
        let [x, y, z] = self.into_trunk(torque);
        let [left, up] = self.axis;
        [
            [fx, fy, fz],
            [x + (left * fz - up * fy), y + up * fx, z - left * fx],
        ]
    }

    /// Returns the acceleration of the frame that belongs to that of the trunk: A and Rᵀ ω̇.
    #[inline(always)]
    #[must_use]
    pub fn acceleration(&self, trunk: [f64; 6]) -> [[L; 3]; 2] {
        let [left, up] = self.axis;
        let [x, y, z, roll, pitch, yaw] = trunk;
        let linear = self.into_leg([up * pitch - left * yaw + x, up * -roll + y, left * roll + z]);
        let zero = left.zero();
        let angular = self.into_leg(broadcast(zero, [roll, pitch, yaw]));
        [linear, angular]
    }
}
