//! Generalised momenta of trunk and links in one configuration, and the corresponding inertia
//! forces.
//!
//! In the frame of the trunk, with the centre of mass of the whole robot at rest, a mass at **r**
//! moves at `v_r` + ω × r + ṙ, where `v_r` = −(ω × S + Ṡ)/m. With the moments `X_j` = Σ m `c_j` r
//! of link j,
//!
//! ```text
//! W_j = b_j v_r + ω × X_j + Σᵢ A_ij θ̇ᵢ nᵢ
//! p_j = W_j · n_j                                ∂T/∂θ_j = W_j · (ω × n_j − θ̇_j e_j)
//! Π = I_c ω + Σⱼ θ̇ⱼ X_j × n_j − S × Ṡ/m          e = (sin θ, 0, −cos θ),  n = de/dθ
//! ```
//!
//! `I_c` is the inertia about the centre of mass with the links locked.

use crate::model::Model;
use crate::model::articulated::Articulated;
use crate::model::constants::Constants;
use crate::model::real::{Lanes, Real};
use crate::model::trunk::cross;

/// Mass distribution in one configuration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Geometry<const N: usize> {
    sines: [Lanes; N],
    cosines: [Lanes; N],
    /// `X_j` in the leg plane; its lateral component is `b_j` times that of the hip.
    forward: [Lanes; N],
    up: [Lanes; N],
    /// The robot with locked links, where its trunk moves.
    pub(super) body: Option<Body>,
}

/// Trunk and legs with the links locked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    /// \[kg\]
    pub(super) mass: f64,
    /// S = Σ m r of the legs about the trunk's centre of mass, trunk axes \[kg·m\].
    pub(super) moment: [f64; 3],
    /// `I_c` \[kg·m²\].
    inertia: [[f64; 3]; 3],
}

/// Momenta at given velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Momenta<const N: usize> {
    /// p of the links \[kg·m²/s\].
    pub(super) links: [Lanes; N],
    /// ∂T/∂θ \[N·m\].
    pub(super) gradients: [Lanes; N],
    /// Π: angular momentum about the centre of mass, trunk axes.
    pub(super) spin: [f64; 3],
    /// Velocity of the robot's centre of mass relative to the trunk's, trunk axes.
    pub(super) relative: [f64; 3],
}

impl<const N: usize> Geometry<N> {
    /// Zero-initialised storage.
    pub(super) fn blank() -> Self {
        let none = [Lanes::zero(); N];
        Self {
            sines: none,
            cosines: none,
            forward: none,
            up: none,
            body: None,
        }
    }

    /// Computes the geometry at these angles of the links.
    #[inline(always)]
    pub(super) fn at(model: &Model<N>, angles: &[Lanes; N]) -> Self {
        let (mut sines, mut cosines) = ([Lanes::zero(); N], [Lanes::zero(); N]);
        for i in 0..N {
            (sines[i], cosines[i]) = Real::sin_cos(angles[i]);
        }
        let mut geometry = Self::about_hips(model, sines, cosines);
        if model.is_free() {
            geometry.body = Some(geometry.locked(model));
            geometry.shift_to_trunk(model);
        }
        geometry
    }

    /// Computes the geometry of a robot whose inertia is known.
    #[inline(always)]
    pub(super) fn of(model: &Model<N>, articulated: &Articulated<Lanes, N>) -> Self {
        let chain = &articulated.chain;
        let mut geometry = Self::about_hips(model, chain.sines, chain.cosines);
        if let Some(base) = &articulated.base {
            geometry.shift_to_trunk(model);
            geometry.body = Some(Body::new(model, base.trunk.moment, base.trunk.inertia));
        }
        geometry
    }

    /// Computes the moments about the hips.
    #[inline(always)]
    fn about_hips(model: &Model<N>, sines: [Lanes; N], cosines: [Lanes; N]) -> Self {
        let legs = &model.side_by_side;
        let (mut forward, mut up) = ([Lanes::zero(); N], [Lanes::zero(); N]);
        for j in 0..N {
            for i in 0..N {
                forward[j] += legs.inertias[i][j] * sines[i];
                up[j] -= legs.inertias[i][j] * cosines[i];
            }
        }
        Self {
            sines,
            cosines,
            forward,
            up,
            body: None,
        }
    }

    /// Shifts the moments from the hips to the trunk's centre of mass.
    #[inline(always)]
    fn shift_to_trunk(&mut self, model: &Model<N>) {
        let legs = &model.side_by_side;
        let [x, _, z] = legs.hip;
        for j in 0..N {
            self.forward[j] += legs.moments[j] * x;
            self.up[j] += legs.moments[j] * z;
        }
    }

    /// Returns the robot with locked links; `X_j` must still be those about the hips.
    #[inline(always)]
    fn locked(&self, model: &Model<N>) -> Body {
        let legs = &model.side_by_side;
        let [hx, hy, hz] = legs.hip;
        let (mut ex, mut ez) = (Lanes::zero(), Lanes::zero());
        let (mut exx, mut ezz, mut exz) = (Lanes::zero(), Lanes::zero(), Lanes::zero());
        for j in 0..N {
            let (s, c) = (self.sines[j], self.cosines[j]);
            ex += legs.moments[j] * s;
            ez -= legs.moments[j] * c;
            exx += self.forward[j] * s;
            ezz -= self.up[j] * c;
            exz -= self.forward[j] * c;
        }
        let (m, two) = (legs.mass, Lanes::splat(2.0));
        let mut moment = [m * hx + ex, m * hy, m * hz + ez].map(Real::sum);
        let [mut xx, mut yy, mut zz] = [
            m * hx * hx + two * hx * ex + exx,
            m * hy * hy,
            m * hz * hz + two * hz * ez + ezz,
        ]
        .map(Real::sum);
        let [mut xy, mut xz, mut yz] = [
            hy * (m * hx + ex),
            m * hx * hz + hx * ez + hz * ex + exz,
            hy * (m * hz + ez),
        ]
        .map(Real::sum);
        if let Some(payload) = &model.trunk.payload {
            moment = std::array::from_fn(|i| moment[i] + payload.moment[i]);
            let legs = [xx, yy, zz, xy, xz, yz];
            [xx, yy, zz, xy, xz, yz] = std::array::from_fn(|i| legs[i] + payload.spread[i]);
        }
        let [own_x, own_y, own_z] = model.trunk.inertia;
        let inertia = [
            [own_x + yy + zz, -xy, -xz],
            [-xy, own_y + xx + zz, -yz],
            [-xz, -yz, own_z + xx + yy],
        ];
        Body::new(model, moment, inertia)
    }

    /// Returns the momenta at these rates of the links and this angular velocity of the trunk.
    #[inline(always)]
    pub(super) fn momenta(
        &self,
        legs: &Constants<Lanes, N>,
        rates: &[Lanes; N],
        turning: [f64; 3],
    ) -> Momenta<N> {
        let zero = Lanes::zero();
        let (mut along, mut above) = ([zero; N], [zero; N]);
        for j in 0..N {
            let moving = [rates[j] * self.cosines[j], rates[j] * self.sines[j]];
            for i in 0..N {
                along[i] += legs.inertias[i][j] * moving[0];
                above[i] += legs.inertias[i][j] * moving[1];
            }
        }
        let mut momenta = Momenta {
            links: [zero; N],
            gradients: [zero; N],
            spin: [0.0; 3],
            relative: [0.0; 3],
        };
        let Some(body) = &self.body else {
            for j in 0..N {
                let (s, c) = (self.sines[j], self.cosines[j]);
                momenta.links[j] = along[j] * c + above[j] * s;
                momenta.gradients[j] = rates[j] * (above[j] * c - along[j] * s);
            }
            return momenta;
        };
        let (drift, spin) = self.against_trunk(legs, rates);
        momenta.spin = body.spin(turning, drift, spin);
        momenta.relative = body.velocity(turning, drift);
        let [vx, vy, vz] = momenta.relative.map(|v| Lanes::splat(-v));
        let [wx, wy, wz] = turning.map(Lanes::splat);
        for j in 0..N {
            let (s, c, b) = (self.sines[j], self.cosines[j], legs.moments[j]);
            let (x, y, z) = (self.forward[j], b * legs.hip[1], self.up[j]);
            let forward = along[j] + b * vx + wy * z - wz * y;
            let left = b * vy + wz * x - wx * z;
            let upward = above[j] + b * vz + wx * y - wy * x;
            momenta.links[j] = forward * c + upward * s;
            momenta.gradients[j] =
                (wy - rates[j]) * (forward * s - upward * c) + left * (wz * c - wx * s);
        }
        momenta
    }

    /// Returns Ṡ and Σ θ̇ⱼ `X_j` × `n_j`.
    #[inline(always)]
    fn against_trunk(
        &self,
        legs: &Constants<Lanes, N>,
        rates: &[Lanes; N],
    ) -> ([f64; 3], [f64; 3]) {
        let zero = Lanes::zero();
        let (mut forward, mut up, mut pitch) = (zero, zero, zero);
        for j in 0..N {
            let (s, c) = (self.sines[j] * rates[j], self.cosines[j] * rates[j]);
            forward += legs.moments[j] * c;
            up += legs.moments[j] * s;
            pitch += self.up[j] * c - self.forward[j] * s;
        }
        let [roll, yaw] = [legs.hip[1] * up, legs.hip[1] * forward].map(Real::sum);
        let [forward, up] = [forward, up].map(Real::sum);
        ([forward, 0.0, up], [roll, pitch.sum(), -yaw])
    }
}

impl<const N: usize> Geometry<N> {
    /// Returns the velocity of the robot's centre of mass relative to the trunk's, trunk axes.
    pub(super) fn relative(
        &self,
        legs: &Constants<Lanes, N>,
        rates: &[Lanes; N],
        turning: [f64; 3],
    ) -> [f64; 3] {
        let (drift, _) = self.against_trunk(legs, rates);
        self.body
            .map_or([0.0; 3], |body| body.velocity(turning, drift))
    }
}

impl Body {
    /// Builds the body from S and the inertia about the trunk's centre of mass.
    fn new<const N: usize>(model: &Model<N>, moment: [f64; 3], mut inertia: [[f64; 3]; 3]) -> Self {
        let mass = model.trunk.mass;
        let square: f64 = moment.iter().map(|s| s * s).sum();
        for i in 0..3 {
            inertia[i][i] -= square / mass;
            for j in 0..3 {
                inertia[i][j] += moment[i] * moment[j] / mass;
            }
        }
        Self {
            mass,
            moment,
            inertia,
        }
    }

    /// Returns the position of the robot's centre of mass relative to the trunk's.
    pub(super) fn offset(&self) -> [f64; 3] {
        self.moment.map(|s| s / self.mass)
    }

    fn velocity(&self, turning: [f64; 3], drift: [f64; 3]) -> [f64; 3] {
        let rotational = cross(turning, self.moment);
        std::array::from_fn(|i| (rotational[i] + drift[i]) / self.mass)
    }

    fn spin(&self, turning: [f64; 3], drift: [f64; 3], relative: [f64; 3]) -> [f64; 3] {
        let lever = cross(self.moment, drift);
        std::array::from_fn(|i| {
            let row = self.inertia[i].iter().zip(&turning);
            row.map(|(i, w)| i * w).sum::<f64>() + relative[i] - lever[i] / self.mass
        })
    }
}
