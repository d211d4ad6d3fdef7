//! One-sided spring with a damper: a stop, a cable or a sole.
//!
//! With the depth x, its rate ẋ, the stiffness k, the damping c and the toe region δ, in which the
//! stiffness grows from zero to k:
//!
//! ```text
//! t = clamp(x, 0, δ)   p = max(x, 0)
//! Fₑ = k (t²/2δ + p − t)             F = max(0, Fₑ + c (t/δ) ẋ)
//! V = k (t³/6δ + (p² − t²)/2 − δ (p − t)/2)
//! ```
//!
//! F is continuous in depth and rate, Fₑ continuously differentiable. The power (F − Fₑ) ẋ is
//! dissipated, and never negative: where F is cut off at zero the element returns without force,
//! and its energy is dissipated, too.

use twinrig_robot::OneSided;

use crate::lanes::{Lanes, Quad, Simd};

/// Elements of four legs; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element<T> {
    /// k \[N/m\].
    stiffness: T,
    /// c/δ \[N·s/m²\].
    damping: T,
    /// δ \[m\], and half of its reciprocal.
    toe_region: T,
    half_per_toe_region: T,
}

/// Force of an element.
#[derive(Debug, Clone, Copy)]
pub struct Press<L> {
    /// F \[N\].
    pub force: L,
    /// Its elastic part Fₑ \[N\], and the derivative of that with respect to the depth \[N/m\].
    pub elastic: L,
    pub(crate) stiffness: L,
    /// Dissipated power \[W\].
    pub dissipated: L,
}

impl Element<Quad> {
    /// Places the elements of up to four legs side by side; an absent leg has no stiffness.
    pub fn side_by_side(legs: impl IntoIterator<Item = OneSided>) -> Self {
        let absent = OneSided {
            stiffness: 0.0,
            damping: 0.0,
            toe_region: 1.0,
        };
        let mut sides = [absent; crate::lanes::LANES];
        sides
            .iter_mut()
            .zip(legs)
            .for_each(|(side, leg)| *side = leg);
        let quad = |of: fn(&OneSided) -> f64| Quad(sides.each_ref().map(of));
        Self {
            stiffness: quad(|side| side.stiffness),
            damping: quad(|side| side.damping / side.toe_region),
            toe_region: quad(|side| side.toe_region),
            half_per_toe_region: quad(|side| 0.5 / side.toe_region),
        }
    }

    /// Returns the elastic force at a share of the toe region \[N\]; at least a number so small
    /// that it has no effect, in place of zero.
    pub(crate) fn force_in_toe(&self, share: f64) -> Quad {
        let (stiffness, region) = (self.stiffness.0, self.toe_region.0);
        let force = |lane: usize| 0.5 * share * share * stiffness[lane] * region[lane];
        Quad(std::array::from_fn(|lane| force(lane).max(1e-100)))
    }

    /// Loads the elements into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Element<S::Lanes> {
        Element {
            stiffness: simd.load(self.stiffness),
            damping: simd.load(self.damping),
            toe_region: simd.load(self.toe_region),
            half_per_toe_region: simd.load(self.half_per_toe_region),
        }
    }
}

impl<L: Lanes> Element<L> {
    /// Returns the force at a depth \[m\] and its rate \[m/s\].
    #[inline(always)]
    pub fn press(&self, depth: L, rate: L) -> Press<L> {
        let zero = depth.zero();
        let pressed = depth.max(zero);
        let toe = pressed.min(self.toe_region);
        let elastic = self.stiffness * (toe * toe * self.half_per_toe_region + (pressed - toe));
        let force = (elastic + self.damping * toe * rate).max(zero);
        Press {
            force,
            elastic,
            stiffness: self.stiffness * (toe * self.half_per_toe_region * 2.0),
            dissipated: (force - elastic) * rate,
        }
    }

    /// Returns the derivatives of the force with respect to the rate \[N·s/m\] and, without the
    /// growth of the damping, to the depth \[N/m\].
    #[inline(always)]
    pub(crate) fn tangent(&self, depth: L, rate: L) -> [L; 2] {
        let (press, zero) = (self.press(depth, rate), depth.zero());
        let damping = self.damping * depth.max(zero).min(self.toe_region);
        let pressed = press.force.gt(zero);
        [damping.or(pressed, zero), press.stiffness.or(pressed, zero)]
    }

    /// Returns the share of the toe region at a depth, negative where it is not compressed.
    #[inline(always)]
    pub(crate) fn toe_share(&self, depth: L) -> L {
        depth * self.half_per_toe_region * 2.0
    }

    /// Returns the elastic force at a depth \[N\].
    #[inline(always)]
    pub(crate) fn elastic(&self, depth: L) -> L {
        let pressed = depth.max(depth.zero());
        let toe = pressed.min(self.toe_region);
        self.stiffness * (toe * toe * self.half_per_toe_region + (pressed - toe))
    }

    /// Returns the energy stored at a depth \[J\].
    #[inline(always)]
    pub fn energy(&self, depth: L) -> L {
        let pressed = depth.max(depth.zero());
        let toe = pressed.min(self.toe_region);
        let beyond = pressed - toe;
        self.stiffness
            * (toe * toe * toe * self.half_per_toe_region * (1.0 / 3.0)
                + beyond * (pressed + toe - self.toe_region) * 0.5)
    }
}
