//! Sole of a foot: a one-sided element along the normal of the ground, and Coulomb friction by a
//! bristle that the load scales.
//!
//! With the normal force Fₙ, the velocity v of the foot along the ground, the deflection z of the
//! bristle, zₛ at the limit of friction, the depth x and the toe region δ of the element:
//!
//! ```text
//! Fₜ = −µ Fₙ z/max(|z|, zₛ)
//! ż = g (v − |v| z/zₛ) + (1 − g) (w zₛ v/√(v² + v₀²) − z)/τ
//! g = clamp(x/εδ, 0, 1)    w = clamp(1 − gap/R, 0, 1)
//! ```
//!
//! The force never leaves the cone of friction. In sliding, z is zₛ along v (Dahl's model, its
//! stiffness µ Fₙ/zₛ proportional to the load); a foot at rest that is pressed beyond εδ stays
//! where it is under any constant load inside the cone. |z| exceeds zₛ by integration errors only.
//! Near the ground the bristle of an unloaded foot turns along its velocity: a foot that lands in
//! motion slides at once, as Coulomb's law demands. Away from the ground it relaxes.

use twinrig_legged::LEGS;

use crate::element::Element;
use crate::lanes::{Lanes, Quad, Simd};

/// Share ε of the toe region over which the bristle begins to follow the ground. ASSUMED: half of
/// it, where a foot of Cheetah-cub bears 0.25 N; less is a switch that substeps of the usual length
/// miss.
const ENGAGEMENT: f64 = 0.5;

/// Distance R from the ground within which the bristle of an unloaded foot turns \[m\], its time
/// constant τ \[s\], and the speed v₀ below which it has no direction \[m/s\]. ASSUMED: a foot that
/// lands at up to 1 m/s is near the ground for four time constants.
const RANGE: f64 = 2e-3;
const TURNING: f64 = 0.5e-3;
const DIRECTED: f64 = 1e-2;

/// Soles of four legs; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sole<T> {
    /// Compression along the normal.
    pub element: Element<T>,
    /// µ/zₛ \[1/m\], and 1/zₛ.
    grip: T,
    per_deflection: T,
}

/// Motion of a contact point relative to the ground.
#[derive(Debug, Clone, Copy)]
pub struct Approach<L> {
    /// Distance from the ground, negative below it \[m\].
    pub gap: L,
    /// Its rate \[m/s\].
    pub gap_rate: L,
    /// Velocity along the two tangents of the ground \[m/s\].
    pub slip: [L; 2],
    /// Deflection of the bristle along the tangents \[m\].
    pub bristle: [L; 2],
}

/// Force of the ground on a contact point.
#[derive(Debug, Clone, Copy)]
pub struct Grip<L> {
    /// Along the normal \[N\].
    pub normal: L,
    /// Along the two tangents \[N\].
    pub tangential: [L; 2],
    /// Rate of the bristle \[m/s\].
    pub bristle_rate: [L; 2],
    /// Dissipated power \[W\].
    pub dissipated: L,
}

impl Sole<Quad> {
    /// Combines elements with the coefficient of friction µ and the deflections zₛ of the legs
    /// \[m\].
    pub fn new(element: Element<Quad>, friction: f64, deflections: &[f64]) -> Self {
        let deflection = |lane: usize| deflections.get(lane).copied().unwrap_or(1.0);
        let per_deflection = Quad(std::array::from_fn(|lane| 1.0 / deflection(lane)));
        Self {
            element,
            grip: Quad(per_deflection.0.map(|share| friction * share)),
            per_deflection,
        }
    }

    /// Sets the coefficients of friction of the legs; bristles keep their deflection.
    pub fn set_friction(&mut self, friction: &[f64; LEGS]) {
        let shares = self.per_deflection.0;
        self.grip = Quad(std::array::from_fn(|lane| friction[lane] * shares[lane]));
    }

    /// Loads the soles into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Sole<S::Lanes> {
        Sole {
            element: self.element.load(simd),
            grip: simd.load(self.grip),
            per_deflection: simd.load(self.per_deflection),
        }
    }
}

impl<L: Lanes> Sole<L> {
    /// Returns the force of the ground.
    #[inline(always)]
    pub fn grip(&self, approach: &Approach<L>) -> Grip<L> {
        let Approach {
            gap,
            gap_rate,
            slip: [u, v],
            bristle: [x, y],
        } = *approach;
        let press = self.element.press(-gap, -gap_rate);
        let (zero, one) = (gap.zero(), gap.like(1.0));
        let deflection = (x * x + y * y).sqrt() * self.per_deflection;
        let pull = press.force * self.grip / deflection.max(one);
        let tangential = [-(pull * x), -(pull * y)];
        let loaded = (self.element.toe_share(-gap) * (1.0 / ENGAGEMENT)).clamp(zero, one);
        let square = u * u + v * v;
        let near = (one - gap * (1.0 / RANGE)).clamp(zero, one);
        let free = (one - loaded) * (1.0 / TURNING);
        let decay = loaded * square.sqrt() * self.per_deflection + free;
        let turned = free * near / ((square + DIRECTED * DIRECTED).sqrt() * self.per_deflection);
        let follow = loaded + turned;
        Grip {
            normal: press.force,
            tangential,
            bristle_rate: [follow * u - decay * x, follow * v - decay * y],
            dissipated: press.dissipated - tangential[0] * u - tangential[1] * v,
        }
    }
}
