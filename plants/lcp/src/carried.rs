//! What a leg and the trunk that carries it are to each other.
//!
//! Velocities are those of the trunk in its own axes, v and ω, and the rates of the links. Whatever has mass m at r has the
//! acceleration
//!
//! ```text
//! a = v̇ + ω̇ × r + Σⱼ cⱼ θ̈ⱼ nⱼ  +  ω × v + ω × (ω × r) + 2 ω × ṙ − Σⱼ cⱼ θ̇ⱼ² eⱼ      n = de/dθ,  ṙ = Σⱼ cⱼ θ̇ⱼ nⱼ
//! ```
//!
//! and m (a − g) along (v, ω, θⱼ), summed over the masses, is the equation of motion. Sums over masses are those of
//! [`Constants`](crate::constants::Constants).

use crate::chain::Chain;
use crate::constants::Constants;
use crate::real::Real;

/// The rows of the trunk that a leg couples to: all but sideways, which its plane does not know. Forward, up, roll, pitch,
/// yaw.
pub(crate) const COUPLED: [usize; 5] = [0, 2, 3, 4, 5];

/// The trunk as a leg sees it, the same in all lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carrier<R> {
    /// Angular velocity, trunk axes.
    pub(crate) turning: [R; 3],
    /// g − ω × v: gravity and what the trunk's own velocity does, trunk axes.
    pub(crate) field: [R; 3],
}

/// What legs add to the trunk's inertia and to the forces on it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Burden<R> {
    /// Σ m r.
    pub(crate) moment: [R; 3],
    /// Σ m r rᵀ: xx, yy, zz, xy, xz, yz.
    pub(crate) spread: [R; 6],
    /// Σ m ṙ: forward, up.
    pub(crate) drift: [R; 2],
    /// Force and torque on the trunk by what moves in the leg: −Σ m a and −Σ m r × a for the last term of a, and
    /// −2 Σ m r × (ω × ṙ).
    pub(crate) force: [R; 2],
    pub(crate) torque: [R; 3],
}

/// A leg on a trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carried<R, const N: usize> {
    /// The columns of the inertia matrix that couple each link to the trunk, in the order of [`COUPLED`].
    pub(crate) columns: [[R; 5]; N],
    /// Torques on the links by the trunk's velocity and its turning, gravity included.
    pub(crate) torques: [R; N],
    pub(crate) burden: Burden<R>,
}

impl<R: Real, const N: usize> Carried<R, N> {
    #[inline(always)]
    pub(crate) fn new(leg: &Constants<R, N>, chain: &Chain<R, N>, trunk: &Carrier<R>) -> Self {
        Self::with::<true>(leg, chain, trunk)
    }

    /// The inertia alone: neither torques nor forces.
    #[inline(always)]
    pub(crate) fn unloaded(leg: &Constants<R, N>, chain: &Chain<R, N>) -> Self {
        let still = Carrier {
            turning: [R::zero(); 3],
            field: [R::zero(); 3],
        };
        Self::with::<false>(leg, chain, &still)
    }

    #[inline(always)]
    fn with<const LOADED: bool>(
        leg: &Constants<R, N>,
        chain: &Chain<R, N>,
        trunk: &Carrier<R>,
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
            // xⱼ = Σ m cⱼ r, in the leg plane; across it is bⱼ times the hip's place.
            let (mut own, mut x, mut z) = (zero, b * hx, b * hz);
            let mut bend = zero;
            for i in 0..N {
                own += chain.inertia[i][j];
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
                b * across - own,
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
            burden: Burden {
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
