//! Inertial forces of legs on a moving trunk.
//!
//! With the angular velocity ω of the trunk, w = (ωx, ωz) and pⱼ = θ̇ⱼ − ω_y, the rates of the links
//! in a frame that does not pitch, a point r = h + Σ cⱼ eⱼ of a leg has, beside v̇ + ω̇ × r + ω × v
//! and the terms of θ̈, the acceleration
//!
//! ```text
//! in the plane:  −ω_y² h + ω_y h_y w − Σ cⱼ pⱼ² eⱼ − κ (−ωz, ωx)     κ = ωx z − ωz x
//! across it:     −|w|² h_y + ω_y w·h − Σ cⱼ (w·eⱼ)(2pⱼ + ω_y)
//! ```
//!
//! The sums over the masses of a leg follow from its constants M, bⱼ and Aᵢⱼ, with Xⱼ = bⱼ h + Σᵢ
//! Aᵢⱼ eᵢ.

use twinrig_compliant::lanes::Lanes;

use super::chain::Turns;
use super::elimination::TrunkShare;
use super::model::Legs;

/// Motion of the trunk in trunk axes, equal in all lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carrier<L> {
    pub(crate) turning: [L; 3],
    /// g − ω × v \[m/s²\].
    pub(crate) field: [L; 3],
}

/// What a leg adds to the equations of the trunk and, by the motion of the trunk, to its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carried<L, const N: usize> {
    /// Columns of the inertia that couple the links to the trunk.
    pub(crate) columns: [[L; 5]; N],
    /// Torques on the links.
    pub(crate) torques: [L; N],
    /// Inertia, and force and torque in the coupled rows.
    pub(crate) share: TrunkShare<L>,
    /// Lateral force \[N\].
    pub(crate) lateral: L,
    /// First moment of the masses, forward and up \[kg·m\].
    pub(crate) moment: [L; 2],
}

impl<L: Lanes, const N: usize> Carried<L, N> {
    /// Computes the terms; `entries` are inertia and swing of the links.
    #[inline(always)]
    pub(crate) fn new(
        legs: &Legs<L, N>,
        turns: &Turns<L, N>,
        rates: &[L; N],
        entries: &[[L; N]; N],
        carrier: &Carrier<L>,
    ) -> Self {
        let [wx, wy, wz] = carrier.turning;
        let [_, hy, _] = legs.hip;
        let [mx, my, mz] = legs.mass_hip;
        let zero = wx.zero();
        let (mut absolute, mut squares) = (*rates, *rates);
        for j in 0..N {
            absolute[j] = rates[j] - wy;
            squares[j] = absolute[j] * absolute[j];
        }
        // Acceleration of the hip in the plane, and field along the links.
        let (wy2, lateral_pull) = (wy * wy, wy * hy);
        let hip = [
            lateral_pull * wx - wy2 * legs.hip[0],
            lateral_pull * wz - wy2 * legs.hip[2],
        ];
        let along = [carrier.field[0] - hip[0], carrier.field[2] - hip[1]];
        // Acceleration across the plane, without the links.
        let across = wy * (wx * legs.hip[0] + wz * legs.hip[2]) - (wx * wx + wz * wz) * hy;
        let mut carried = Self {
            columns: [[zero; 5]; N],
            torques: *rates,
            share: TrunkShare {
                matrix: [zero; 15],
                force: [zero; 5],
            },
            lateral: zero,
            moment: [mx, mz],
        };
        let (mut xx, mut zz, mut xz) = (zero, zero, zero);
        let (mut fx, mut fz, mut pitch) = (zero, zero, zero);
        let (mut fy, mut around_z, mut around_x) = (zero, zero, zero);
        for j in 0..N {
            let (s, c) = (turns.sines[j], turns.cosines[j]);
            let [mut x, _, mut z] = legs.moments_hip[j];
            for i in 0..N {
                x += legs.inertias[i][j] * turns.sines[i];
                z -= legs.inertias[i][j] * turns.cosines[i];
            }
            let (bx, bz) = (legs.moments[j] * c, legs.moments[j] * s);
            carried.columns[j] = [bx, bz, hy * bz, z * c - x * s, -(hy * bx)];
            carried.moment[0] += bz;
            carried.moment[1] -= bx;
            xx += s * x;
            zz -= c * z;
            xz += s * z;
            // w·e, which is w × n, too.
            let across_link = wx * s - wz * c;
            let mut torque = bx * along[0] + bz * along[1] + (wx * z - wz * x) * across_link;
            for i in 0..N {
                if i < j {
                    torque += entries[i][j] * squares[i];
                } else if i > j {
                    torque -= entries[j][i] * squares[i];
                }
            }
            carried.torques[j] = torque;
            fx += squares[j] * bz;
            fz -= squares[j] * bx;
            pitch += squares[j] * (z * s + x * c);
            let coriolis = across_link * (absolute[j] + absolute[j] + wy);
            fy += legs.moments[j] * coriolis;
            around_x += z * coriolis;
            around_z += x * coriolis;
        }
        let [sx, sz] = carried.moment;
        let (pxx, pzz) = (xx + legs.hip[0] * sx, zz + legs.hip[2] * sz);
        let pxz = xz + legs.hip[0] * sz;
        let pyy = hy * my;
        carried.share.matrix = [
            zero,
            zero,
            zero,
            zero,
            my,
            pyy + pzz,
            sz,
            -sx,
            -(hy * sx),
            pxx + pzz,
            -my,
            zero,
            -pxz,
            -(hy * sz),
            pxx + pyy,
        ];
        // Σ m κ.
        let turned = wx * sz - wz * sx;
        let fx = fx - legs.mass * hip[0] - turned * wz;
        let fz = fz - legs.mass * hip[1] + turned * wx;
        carried.lateral = fy - legs.mass * across;
        let twist = wx * wz * (pzz - pxx) + (wx * wx - wz * wz) * pxz;
        carried.share.force = [
            fx,
            fz,
            hy * fz + across * sz - around_x,
            pitch - sz * hip[0] + sx * hip[1] - twist,
            around_z - across * sx - hy * fx,
        ];
        carried
    }
}
