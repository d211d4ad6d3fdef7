//! Inertial coupling between a leg and the trunk.
//!
//! The velocities are those of the trunk in trunk axes, v and ω, and the rates of the links. A mass
//! m at r has the acceleration
//!
//! ```text
//! a = v̇ + ω̇ × r + Σⱼ cⱼ θ̈ⱼ nⱼ
//!   + ω × v + ω × (ω × r) + 2 ω × ṙ − Σⱼ cⱼ θ̇ⱼ² eⱼ        n = de/dθ,  ṙ = Σⱼ cⱼ θ̇ⱼ nⱼ
//! ```
//!
//! The projection of m (a − g) on (v, ω, θⱼ), summed over the masses, is the equation of motion.
//! The sums over the masses are those of [`Constants`].

use crate::model::chain::Chain;
use crate::model::constants::Constants;
use crate::model::real::Real;

/// Rows of the trunk coupled to a leg: forward, up, roll, pitch, yaw. The lateral direction is
/// normal to the leg's plane and uncoupled.
pub(crate) const COUPLED: [usize; 5] = [0, 2, 3, 4, 5];

/// Motion of the trunk in the equations of a leg, equal in all lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkMotion<R> {
    /// Angular velocity, trunk axes.
    pub(crate) turning: [R; 3],
    /// g − ω × v: gravity and the acceleration by the trunk's velocity, trunk axes.
    pub(crate) field: [R; 3],
}

/// Contribution of the legs to the inertia of the trunk and to the forces on it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegContribution<R> {
    /// Σ m r.
    pub(crate) moment: [R; 3],
    /// Σ m r rᵀ: xx, yy, zz, xy, xz, yz.
    pub(crate) spread: [R; 6],
    /// Σ m ṙ: forward, up.
    pub(crate) drift: [R; 2],
    /// Force and torque on the trunk by the motion of the leg: −Σ m a and −Σ m r × a for the last
    /// term of a, and −2 Σ m r × (ω × ṙ).
    pub(crate) force: [R; 2],
    pub(crate) torque: [R; 3],
}

/// Coupling terms of a leg on a trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegCoupling<R, const N: usize> {
    /// Columns of the inertia matrix that couple each link to the trunk, in the order of
    /// [`COUPLED`].
    pub(crate) columns: [[R; 5]; N],
    /// Torques on the links by the linear and angular velocity of the trunk, including gravity.
    pub(crate) torques: [R; N],
    pub(crate) contribution: LegContribution<R>,
}

impl<R: Real, const N: usize> LegCoupling<R, N> {
    #[inline(always)]
    pub(crate) fn new(leg: &Constants<R, N>, chain: &Chain<R, N>, trunk: &TrunkMotion<R>) -> Self {
        Self::with::<true>(leg, chain, trunk)
    }

    /// Computes the inertia only, without torques and forces.
    #[inline(always)]
    pub(crate) fn unloaded(leg: &Constants<R, N>, chain: &Chain<R, N>) -> Self {
        let at_rest = TrunkMotion {
            turning: [R::zero(); 3],
            field: [R::zero(); 3],
        };
        Self::with::<false>(leg, chain, &at_rest)
    }

    #[inline(always)]
    fn with<const LOADED: bool>(
        leg: &Constants<R, N>,
        chain: &Chain<R, N>,
        trunk: &TrunkMotion<R>,
    ) -> Self {
        let zero = R::zero();
        let [hx, hy, hz] = leg.hip;
        let [wx, wy, wz] = trunk.turning;
        let square = wx * wx + wy * wy + wz * wz;
        let two = R::splat(2.0);
        let mut columns = [[zero; 5]; N];
        let mut torques = [zero; N];
        if LOADED {
            torques = chain.torques(leg, [trunk.field[0], trunk.field[2]]);
        }
        // Σ bⱼ eⱼ and Σᵢⱼ Aᵢⱼ eᵢ eⱼᵀ
        let (mut ex, mut ez) = (zero, zero);
        let (mut exx, mut ezz, mut exz) = (zero, zero, zero);
        let (mut drift, mut force) = ([zero; 2], [zero; 2]);
        let mut torque = [zero; 3];
        let mut stretch = zero;
        for j in 0..N {
            let (s, c, b, rate) = (
                chain.sines[j],
                chain.cosines[j],
                leg.moments[j],
                chain.rates[j],
            );
            // xⱼ = Σ m cⱼ r, in the leg plane; its lateral component is bⱼ times that of the hip.
            let (mut about_hip, mut x, mut z) = (zero, b * hx, b * hz);
            let mut bend = zero;
            for i in 0..N {
                about_hip += chain.inertia[i][j];
                x += leg.inertias[i][j] * chain.sines[i];
                z -= leg.inertias[i][j] * chain.cosines[i];
                if i != j {
                    bend += chain.swing[i][j];
                }
                exx += leg.inertias[i][j] * chain.sines[i] * s;
                ezz += leg.inertias[i][j] * chain.cosines[i] * c;
                exz -= leg.inertias[i][j] * chain.sines[i] * c;
            }
            ex += b * s;
            ez -= b * c;
            let (nx, nz) = (c, s);
            let across = hz * nx - hx * nz;
            columns[j] = [
                b * nx,
                b * nz,
                b * hy * nz,
                b * across - about_hip,
                -(b * hy * nx),
            ];
            drift[0] += b * rate * nx;
            drift[1] += b * rate * nz;
            if !LOADED {
                continue;
            }
            // n·x, ω·x and ω·n.
            let along = nx * x + nz * z;
            let turned = wx * x + wy * (b * hy) + wz * z;
            let mut coriolis = zero;
            for i in 0..N {
                if i != j {
                    coriolis += chain.swing[i][j] * chain.rates[i];
                }
            }
            torques[j] += square * along - (wx * nx + wz * nz) * turned - two * wy * coriolis;
            let rate2 = rate * rate;
            force[0] += rate2 * b * s;
            force[1] -= rate2 * b * c;
            // r × e, with e = (s, 0, −c).
            torque[0] -= rate2 * b * hy * c;
            torque[1] += rate2 * (b * (hz * s + hx * c) + bend);
            torque[2] -= rate2 * b * hy * s;
            // −2 Σ m r × (ω × ṙ) = 2 Σ m ṙ (r·ω) − 2 ω Σ m r·ṙ
            torque[0] += two * rate * nx * turned;
            torque[2] += two * rate * nz * turned;
            stretch += rate * along;
        }
        for (t, w) in torque.iter_mut().zip(trunk.turning) {
            *t -= two * w * stretch;
        }
        let m = leg.mass;
        Self {
            columns,
            torques,
            contribution: LegContribution {
                moment: [m * hx + ex, m * hy, m * hz + ez],
                spread: [
                    m * hx * hx + two * hx * ex + exx,
                    m * hy * hy,
                    m * hz * hz + two * hz * ez + ezz,
                    m * hx * hy + hy * ex,
                    m * hx * hz + hx * ez + hz * ex + exz,
                    m * hy * hz + hy * ez,
                ],
                drift,
                force,
                torque,
            },
        }
    }
}
