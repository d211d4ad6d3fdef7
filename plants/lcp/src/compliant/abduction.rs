//! Legs that abduct, with the links eliminated.

use twinrig_compliant::lanes::Lanes;
use twinrig_compliant::{JointDrive, LegBody, LegFrame};

use super::elimination::PlaneShare;

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

impl<L: Lanes> OffPlane<L> {
    /// Composes the inertia and the force of a leg with its share of the plane, which is `beside`
    /// the origin of the frame \[m\], under the field of the frame.
    #[inline(always)]
    pub(crate) fn body(
        &self,
        (mass, beside): (L, L),
        share: &PlaneShare<L>,
        frame: &LegFrame<L>,
    ) -> LegBody<L> {
        let [xx, zx, zz, px, pz, pp] = share.matrix;
        let [fx, fz, pitch] = share.force;
        let [sx, sz] = self.moment;
        let [spread_xx, spread_zz, spread_xz] = self.spread;
        let (bxx, bzx, bzz) = (beside * xx, beside * zx, beside * zz);
        let zero = xx.zero();
        let sy = mass * beside;
        let [gx, gy, gz] = frame.field;
        let body = LegBody {
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
            force: [fx + mass * gx, self.lateral + mass * gy, fz + mass * gz],
            torque: [
                self.roll + beside * fz + (sy * gz - sz * gy),
                pitch + (sz * gx - sx * gz),
                self.yaw - beside * fx + (sx * gy - sy * gx),
            ],
        };
        body.swung(frame.swing)
    }
}
