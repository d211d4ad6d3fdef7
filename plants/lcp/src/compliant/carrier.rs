//! Inertial forces of legs on a moving trunk.
//!
//! With the angular velocity ω of the trunk, w = (ωx, ωz) and pⱼ = θ̇ⱼ − ωy, the rates of the
//! links in a frame that does not pitch, a point r = h + Σ cⱼ eⱼ of a leg has, beside v̇ + ω̇ × r +
//! ω × v and the terms of θ̈, the acceleration
//!
//! ```text
//! in the plane:  −ωy² h + ωy hy w − Σ cⱼ pⱼ² eⱼ − κ (−ωz, ωx)     κ = ωx z − ωz x
//! across it:     −|w|² hy + ωy w·h − Σ cⱼ (w·eⱼ)(2pⱼ + ωy)
//! ```
//!
//! The sums over the masses of a leg follow from its constants M, bⱼ and Aᵢⱼ, with Xⱼ = bⱼ h + Σᵢ
//! Aᵢⱼ eᵢ.

use twinrig_compliant::Turns;
use twinrig_compliant::lanes::Lanes;

use super::abduction::OffPlane;
use super::elimination::{PLANE, PlaneShare};
use super::model::Legs;

/// Motion of the trunk in trunk axes, equal in all lanes, or of the frame of each leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carrier<L> {
    pub(crate) turning: [L; 3],
    /// Gravity less the acceleration of the origin, but for the rate of its velocity \[m/s²\]: of
    /// the trunk g − ω × v.
    pub(crate) field: [L; 3],
}

/// Terms of a leg in the equations of the trunk and, by the motion of the trunk, in its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carried<L, const N: usize> {
    /// Columns of the inertia that couple the links to the plane.
    pub(crate) columns: [[L; PLANE]; N],
    /// Torques on the links.
    pub(crate) torques: [L; N],
    /// Inertia and force in the plane.
    pub(crate) share: PlaneShare<L>,
    pub(crate) off_plane: OffPlane<L>,
}

impl<L: Lanes, const N: usize> Carried<L, N> {
    /// Computes the terms; `entries` are inertia and swing of the links.
    #[inline(always)]
    pub(crate) fn new<const A: usize>(
        legs: &Legs<L, N, A>,
        turns: &Turns<L, N>,
        rates: &[L; N],
        entries: &[[L; N]; N],
        carrier: &Carrier<L>,
    ) -> Self {
        let [wx, wy, wz] = carrier.turning;
        let [hx, hy, hz] = legs.hip;
        let [mx, _, mz] = legs.mass_hip;
        let zero = wx.zero();
        // Acceleration of the hip in the plane, and field along the links.
        let (wy2, lateral_pull) = (wy * wy, wy * hy);
        let hip = [lateral_pull * wx - wy2 * hx, lateral_pull * wz - wy2 * hz];
        let along = [carrier.field[0] - hip[0], carrier.field[2] - hip[1]];
        // Acceleration across the plane, without the links.
        let across = wy * (wx * hx + wz * hz) - (wx * wx + wz * wz) * hy;
        let (mut columns, mut torques) = ([[zero; PLANE]; N], *rates);
        let [mut sx, mut sz] = [mx, mz];
        let (mut xx, mut zz, mut xz) = (hx * mx, hz * mz, hx * mz);
        let (mut fx, mut fz, mut pitch) = (zero, zero, zero);
        let (mut lateral, mut roll, mut yaw) = (zero, zero, zero);
        let mut squares = *rates;
        for square in &mut squares {
            let absolute = *square - wy;
            *square = absolute * absolute;
        }
        for j in 0..N {
            let (s, c) = (turns.sines[j], turns.cosines[j]);
            let [mut x, _, mut z] = legs.moments_hip[j];
            for i in 0..N {
                x += legs.inertias[i][j] * turns.sines[i];
                z -= legs.inertias[i][j] * turns.cosines[i];
            }
            let (bx, bz) = (legs.moments[j] * c, legs.moments[j] * s);
            columns[j] = [bx, bz, z * c - x * s];
            sx += bz;
            sz -= bx;
            xx += s * x + hx * bz;
            zz -= c * z + hz * bx;
            xz += s * z - hx * bx;
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
            torques[j] = torque;
            fx += squares[j] * bz;
            fz -= squares[j] * bx;
            pitch += squares[j] * (z * s + x * c);
            let coriolis = across_link * (rates[j] + rates[j] - wy);
            lateral += legs.moments[j] * coriolis;
            roll -= z * coriolis;
            yaw += x * coriolis;
        }
        // Σ m κ.
        let turned = wx * sz - wz * sx;
        let twist = wx * wz * (zz - xx) + (wx * wx - wz * wz) * xz;
        Self {
            columns,
            torques,
            share: PlaneShare {
                matrix: [legs.mass, zero, legs.mass, sz, -sx, xx + zz],
                force: [
                    fx - legs.mass * hip[0] - turned * wz,
                    fz - legs.mass * hip[1] + turned * wx,
                    pitch - sz * hip[0] + sx * hip[1] - twist,
                ],
            },
            off_plane: OffPlane {
                lateral: lateral - legs.mass * across,
                roll: roll + across * sz,
                yaw: yaw - across * sx,
                moment: [sx, sz],
                spread: [xx, zz, xz],
            },
        }
    }
}
