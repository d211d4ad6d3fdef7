//! Sole of a foot: a one-sided element along the normal of the ground, and Coulomb friction by a
//! bristle that stores energy in proportion to the elastic load.
//!
//! With the normal force F and its elastic part Fₑ, the depth x and the toe region δ of the
//! element, the velocity v of the foot along the ground, the deflection z of the bristle and zₛ at
//! the limit of friction:
//!
//! ```text
//! S = Fₑ(x) + S₀    g = clamp(x/εδ, 0, 1)    b = g min(F, S)    q = min(|z|/zₛ, 1)
//! V = ½ (µ₀ S/zₛ) |z|²
//! Fₜ = −µ b z/max(|z|, zₛ) − µ (F − b) v/√(v² + v₀²)
//! ż = r v − (max(r |v|/zₛ, h⁺) − h⁻ (1 − q²) + (1 − g)/τ) z
//! r = (µ/µ₀) (b/S) zₛ/max(|z|, zₛ)    h = Ṡ/2S = h⁺ − h⁻
//! ```
//!
//! The bristle bears b of the load, viscous friction the rest: light loads, and what a damper adds
//! to the elastic force. Both stay in the cone of friction, whose limit is reached in sliding. A
//! foot at rest that is pressed beyond εδ under a constant load inside the cone stays where it is.
//!
//! # Passivity
//!
//! A spring whose stiffness µ₀ S/zₛ follows the load takes the power ½ (µ₀ Ṡ/zₛ) |z|² where it is
//! stretched and the load grows. Friction cannot draw it from the normal motion, so z gives way: by
//! −h z the energy stays as it is. In sliding, what the bristle dissipates pays for it, r |v|/zₛ of
//! each h, and z remains at zₛ: hence the larger of the two. Where the load falls the same term
//! stretches the bristle, but not beyond zₛ, so that load that oscillates gives back what it takes.
//! The sum
//!
//! ```text
//! −Fₜ·v − V̇ = (µ₀ S/zₛ) |z|² (max(r |v|/zₛ, h⁺) − h⁺ + h⁻ q² + (1 − g)/τ)
//!           + µ (F − b) v²/√(v² + v₀²)
//! ```
//!
//! has no negative term, in any state: friction is passive for all motions and loads. S depends on
//! the depth alone, so its rate needs no acceleration, and S₀ bounds h by |ẋ|/δ where Fₑ begins. It
//! is Fₑ(δ/2): a share of 5 % at 5 N on Cheetah-cub. V does not depend on µ, which may change under
//! a foot; µ₀ is that of the ground without patches.
//!
//! What is left is Dahl's creep: where force or load oscillates inside the cone, the foot moves a
//! little in each cycle along the mean force.

use twinrig_legged::LEGS;

use crate::element::Element;
use crate::lanes::{Lanes, Quad, Simd};

/// Share ε of the toe region over which the bristle begins to bear the load. ASSUMED: half of it,
/// where a foot of Cheetah-cub bears 0.25 N; less is a switch that substeps of the usual length
/// miss.
const ENGAGEMENT: f64 = 0.5;

/// Time constant τ of the bristle of an unloaded foot \[s\]. ASSUMED: short against a swing.
const RELAXATION: f64 = 2e-3;

/// Speed v₀ at which friction that no bristle bears reaches 0.7 of its limit \[m/s\]. ASSUMED.
const SLOW: f64 = 5e-2;

/// Share of the toe region whose elastic force is S₀.
const LEAST: f64 = 0.5;

/// Soles of four legs; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sole<T> {
    /// Compression along the normal.
    pub element: Element<T>,
    /// µ, and its ratio to that of the stored energy, µ₀.
    friction: T,
    relative: T,
    /// 1/zₛ \[1/m\], and µ₀/zₛ.
    per_deflection: T,
    stored: T,
    /// S₀ \[N\].
    least: T,
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
    /// Combines elements with the coefficient of friction µ₀ and the deflections zₛ of the legs
    /// \[m\].
    pub fn new(element: Element<Quad>, friction: f64, deflections: &[f64]) -> Self {
        let deflection = |lane: usize| deflections.get(lane).copied().unwrap_or(1.0);
        let per_deflection = Quad(std::array::from_fn(|lane| 1.0 / deflection(lane)));
        // A ground without friction stores nothing, unless a patch of it has friction.
        let stored = if friction > 0.0 { friction } else { 1.0 };
        Self {
            friction: Quad::splat(friction),
            relative: Quad::splat(friction / stored),
            per_deflection,
            stored: Quad(per_deflection.0.map(|share| stored * share)),
            least: element.force_in_toe(LEAST),
            element,
        }
    }

    /// Sets the coefficients of friction of the legs. Bristles keep their deflection, and their
    /// energy, which does not depend on it.
    pub fn set_friction(&mut self, friction: &[f64; LEGS]) {
        self.friction = Quad(*friction);
        self.relative = Quad(std::array::from_fn(|lane| {
            friction[lane] * self.per_deflection.0[lane] / self.stored.0[lane]
        }));
    }

    /// Loads the soles into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Sole<S::Lanes> {
        Sole {
            element: self.element.load(simd),
            friction: simd.load(self.friction),
            relative: simd.load(self.relative),
            per_deflection: simd.load(self.per_deflection),
            stored: simd.load(self.stored),
            least: simd.load(self.least),
        }
    }
}

impl<L: Lanes> Sole<L> {
    /// Returns the rate of the bristle of a foot in the air \[m/s\].
    #[inline(always)]
    pub(crate) fn relaxation([x, y]: [L; 2]) -> [L; 2] {
        let per_time = x.like(1.0 / RELAXATION);
        [-(per_time * x), -(per_time * y)]
    }

    /// Returns the power that it dissipates \[W\].
    #[inline(always)]
    pub(crate) fn relaxed_power(&self, [x, y]: [L; 2]) -> L {
        self.stored * self.least * (x * x + y * y) * (1.0 / RELAXATION)
    }

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
        let engaged = (self.element.toe_share(-gap) * (1.0 / ENGAGEMENT)).clamp(zero, one);
        // S, and ½ Ṡ/S.
        let scale = press.elastic + self.least;
        let per_scale = scale.reciprocal();
        let growth = press.stiffness * gap_rate * per_scale * -0.5;
        let (grows, falls) = (growth.max(zero), (-growth).max(zero));
        let square = x * x + y * y;
        let stretch = square.sqrt() * self.per_deflection;
        let within = stretch.min(one);
        let borne = engaged * press.force.min(scale);
        let held = borne / stretch.max(one);
        let follow = self.relative * held * per_scale;
        let speed_square = u * u + v * v;
        let slide = (follow * speed_square.sqrt() * self.per_deflection).max(grows);
        let free = (one - engaged) * (1.0 / RELAXATION);
        let kept = one - within * within;
        let decay = slide - falls * kept + free;
        let pull = self.friction * held * self.per_deflection;
        let direct = self.friction * (press.force - borne) / (speed_square + SLOW * SLOW).sqrt();
        let loss = slide - grows + falls * (one - kept) + free;
        Grip {
            normal: press.force,
            tangential: [-(pull * x + direct * u), -(pull * y + direct * v)],
            bristle_rate: [follow * u - decay * x, follow * v - decay * y],
            dissipated: press.dissipated
                + direct * speed_square
                + self.stored * scale * square * loss,
        }
    }

    /// Returns the energy of element and bristle at a depth \[J\].
    #[inline(always)]
    pub fn energy(&self, depth: L, [x, y]: [L; 2]) -> L {
        let scale = self.element.elastic(depth) + self.least;
        self.element.energy(depth) + self.stored * scale * (x * x + y * y) * 0.5
    }
}
