//! Exponential method along a stiff mode of each leg.
//!
//! Where a light drive bears a damper, one mode of the leg is far faster than all others: an
//! explicit method needs substeps of its time constant although nothing of interest moves along it.
//! With the rate λ of that mode, its vector r, and the covector ℓ with ℓ·r = 1, the equations are
//!
//! ```text
//! y = y₀ + Δ      Δ̇ = λ r (ℓ·Δ) + g(Δ)
//! ```
//!
//! Across r the stages are those of the explicit method. Along r, x = ℓ·Δ obeys ẋ = λ x + ℓ·g,
//! whose linear part is integrated exactly, with φₖ of z = λh in place of 1/k!: an exponential
//! Runge–Kutta method (Cox and Matthews, J. Comput. Phys. 176, 2002; Krogstad, J. Comput. Phys.
//! 203, 2005; Hochbruck and Ostermann, Acta Numerica 19, 2010). The mode is taken out of the slope
//! and put back: for any λ, r and ℓ the solution converges with order 4 to that of the equations,
//! limits and one-sided forces included. What the mode is decides about stability alone, so it may
//! be an estimate, and is one matrix of rank one, fixed over a substep.
//!
//! # Weights
//!
//! With the slopes' differences from the first, dⱼ = ℓ·(gⱼ − g₁), the nodes cⱼ = 0, ¼, ⅗, 1 and
//! the moments mₖ = Σ wⱼ cⱼᵏ of the weights of dⱼ, x = h φ₁(c z) c ℓ·g₁ + h Σ wⱼ dⱼ has
//!
//! | at | m₁ | m₂ | m₃ |
//! |---|---|---|---|
//! | ⅗ | (⅗)² φ₂(⅗z) + 3⁄100 exp(⅗z) | | |
//! | 1, fourth stage | φ₂(z) − 1⁄20 (1 + 4z/21) exp z | 2φ₃(z) + 19⁄240 exp z | |
//! | 1, end | φ₂(z) | 2φ₃(z) | 6φ₄(z) − z/240 exp z |
//!
//! The φₖ integrate polynomials exactly; what is added vanishes in a stiff mode. At z = 0 it leads
//! to the explicit weights, and its derivatives there are those of the conditions of order 4 that
//! an explicit method does not have: Σ bⱼ′ eⱼ = Σ bⱼ eⱼ′ = 0 with the defects eⱼ of m₁.
//!
//! # Work
//!
//! Weighted sums of powers miss what happens along the mode between the stages. With the loads and
//! losses of the mode, [`Unseen`] has the integrals of x and x² less their weighted sums.

use super::weights::{ERROR, FOURTH, MEAN, SECOND, THIRD};
use crate::lanes::Lanes;

/// Product of a substep and the rate of a mode from which on it is integrated exponentially; the
/// explicit method is accurate below it, and the φₖ lose digits to cancellation.
const FAST: f64 = 0.5;

/// Greatest product that is distinguished; the exponential of it has no effect.
const FASTEST: f64 = 600.0;

/// Stiff mode of each leg.
pub trait Mode: Copy {
    /// State.
    type State;
    /// Slope.
    type Slope;
    /// Numbers of four legs.
    type Lanes: Lanes;

    /// Returns λ, not positive \[1/s\].
    fn rate(&self) -> Self::Lanes;

    /// Returns ℓ·k of a slope.
    fn part(&self, slope: &Self::Slope) -> Self::Lanes;

    /// Returns a state or a difference of states with a multiple of r added.
    fn added(&self, state: &Self::State, amount: Self::Lanes) -> Self::State;
}

/// Mode of a system that has none.
#[derive(Debug)]
pub struct NoMode<X, K, L>(
    core::convert::Infallible,
    core::marker::PhantomData<(X, K, L)>,
);

impl<X, K, L> Clone for NoMode<X, K, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<X, K, L> Copy for NoMode<X, K, L> {}

impl<X, K, L: Lanes> Mode for NoMode<X, K, L> {
    type State = X;
    type Slope = K;
    type Lanes = L;

    fn rate(&self) -> L {
        match self.0 {}
    }

    fn part(&self, _: &K) -> L {
        match self.0 {}
    }

    fn added(&self, _: &X, _: L) -> X {
        match self.0 {}
    }
}

/// Motion along a mode that weighted sums over the stages do not contain.
#[derive(Debug, Clone, Copy)]
pub struct Unseen<M: Mode> {
    /// The mode.
    pub mode: M,
    /// ∫x dt and ∫x² dt, less their weighted sums \[s\].
    pub integrals: [M::Lanes; 2],
}

/// Error of a substep along a mode.
#[derive(Debug, Clone, Copy)]
pub struct Missed<'a, M: Mode> {
    /// The mode.
    pub mode: &'a M,
    /// Difference of x from that of the weighted sum of slopes.
    pub amount: M::Lanes,
    /// Error of ∫x dt that the weighted sum of slopes does not contain \[s\].
    pub integral: M::Lanes,
}

/// Weights along a mode: of ℓ·g₁ and dⱼ.
#[derive(Debug, Clone, Copy)]
struct Weights<L> {
    second: [L; 1],
    third: [L; 2],
    fourth: [L; 3],
    end: [L; 4],
    /// exp(z/4), exp(3z/5) and exp z.
    decays: [L; 3],
}

/// Returns exp(z/20) for z ≤ 0.
#[inline(always)]
fn twentieth<L: Lanes>(z: L) -> L {
    const SQUARINGS: u32 = 7;
    let x = z * (1.0 / f64::from(20 << SQUARINGS));
    let one = x.like(1.0);
    let mut exp = one;
    for k in (1..=10).rev() {
        exp = one + x * exp * (1.0 / f64::from(k));
    }
    for _ in 0..SQUARINGS {
        exp = exp * exp;
    }
    exp
}

impl<L: Lanes> Weights<L> {
    #[inline(always)]
    fn new(z: L) -> Self {
        let per = z.reciprocal();
        let q = twentieth(z.max(z.like(-FASTEST)));
        let fourth = q * q * (q * q);
        let (a, b) = (fourth * q, fourth * fourth * fourth);
        let e = b * (fourth * fourth);
        let one = (e - 1.0) * per;
        let two = (one - 1.0) * per;
        let three = (two - 0.5) * per;
        let four = (three - 1.0 / 6.0) * per;
        let at_third = (b - 1.0) * per;
        let third = ((at_third - 0.6) * per + b * 0.03) * 4.0;
        let m1 = two - (z * (4.0 / 21.0) + 1.0) * e * 0.05;
        let m2 = three * 2.0 + e * (19.0 / 240.0);
        let late = (m2 - m1 * 0.25) * (1.0 / 0.21);
        let (n1, n2) = (two, three * 2.0);
        let n3 = four * 6.0 - z * e * (1.0 / 240.0);
        // Divided differences over 0, ¼, ⅗ and 1.
        Self {
            second: [(a - 1.0) * per],
            third: [at_third, third],
            fourth: [one, (m1 - late * 0.6) * 4.0, late],
            end: [
                one,
                (n3 - n2 * 1.6 + n1 * 0.6) * (1.0 / (0.25 * 0.35 * 0.75)),
                (n2 * 1.25 - n1 * 0.25 - n3) * (1.0 / (0.6 * 0.35 * 0.4)),
                (n3 - n2 * 0.85 + n1 * 0.15) * (1.0 / (0.75 * 0.4)),
            ],
            decays: [a, b, e],
        }
    }
}

/// Substep along a mode.
#[derive(Clone, Copy)]
pub(super) struct Along<M: Mode> {
    mode: M,
    seconds: f64,
    /// z, and where it is that of a stiff mode.
    z: M::Lanes,
    stiff: <M::Lanes as Lanes>::Mask,
    weights: Weights<M::Lanes>,
    /// ℓ·kⱼ, and dⱼ.
    parts: [M::Lanes; 5],
    bends: [M::Lanes; 5],
    /// x/h in the state of the last stage.
    place: M::Lanes,
}

impl<M: Mode> Along<M> {
    /// Creates a substep from its first slope; none where the mode is not stiff in it.
    #[inline(always)]
    pub(super) fn new(mode: M, first: &M::Slope, seconds: f64) -> Option<Self> {
        let z = mode.rate() * seconds;
        let (zero, least) = (z.zero(), z.like(-FAST));
        let stiff = least.gt(z);
        if !z.any(stiff) {
            return None;
        }
        let z = z.min(least);
        let (mut parts, bends) = ([zero; 5], [zero; 5]);
        parts[0] = mode.part(first);
        Some(Self {
            mode,
            seconds,
            z,
            stiff,
            weights: Weights::new(z),
            parts,
            bends,
            place: zero,
        })
    }

    /// Returns the state of a stage, from that of the explicit method with these weights.
    #[inline(always)]
    fn stage<const J: usize>(
        &mut self,
        explicit: &M::State,
        row: [f64; J],
        weights: [M::Lanes; J],
    ) -> M::State {
        let mut place = weights[0] * self.parts[0];
        let mut straight = self.parts[0] * row[0];
        for j in 1..J {
            place += weights[j] * self.bends[j];
            straight += self.parts[j] * row[j];
        }
        self.place = place;
        self.mode
            .added(explicit, self.where_stiff(place - straight))
    }

    #[inline(always)]
    fn where_stiff(&self, change: M::Lanes) -> M::Lanes {
        let zero = change.zero();
        (change * self.seconds).or(self.stiff, zero)
    }

    #[inline(always)]
    pub(super) fn second(&mut self, explicit: &M::State) -> M::State {
        self.stage(explicit, SECOND, self.weights.second)
    }

    #[inline(always)]
    pub(super) fn third(&mut self, explicit: &M::State, second: &M::Slope) -> M::State {
        self.see(1, second);
        self.stage(explicit, THIRD, self.weights.third)
    }

    #[inline(always)]
    pub(super) fn fourth(&mut self, explicit: &M::State, third: &M::Slope) -> M::State {
        self.see(2, third);
        self.stage(explicit, FOURTH, self.weights.fourth)
    }

    #[inline(always)]
    pub(super) fn end(&mut self, explicit: &M::State, fourth: &M::Slope) -> M::State {
        self.see(3, fourth);
        self.stage(explicit, MEAN, self.weights.end)
    }

    #[inline(always)]
    fn see(&mut self, j: usize, slope: &M::Slope) {
        self.parts[j] = self.mode.part(slope);
        self.bends[j] = self.parts[j] - self.z * self.place - self.parts[0];
    }

    /// Returns the error, once all slopes are known.
    #[inline(always)]
    pub(super) fn missed(&mut self, last: &M::Slope) -> Missed<'_, M> {
        self.see(4, last);
        let (mut bent, mut straight) = (self.z.zero(), self.parts[0] * ERROR[0]);
        for (j, weight) in ERROR.into_iter().enumerate().skip(1) {
            bent += self.bends[j] * weight;
            straight += self.parts[j] * weight;
        }
        let amount = self.where_stiff(self.weights.end[0] * bent - straight);
        Missed {
            mode: &self.mode,
            amount,
            integral: amount * self.seconds / self.z,
        }
    }

    /// Returns what weighted sums do not contain, once all slopes but the last are known.
    #[inline(always)]
    pub(super) fn unseen(&self) -> Unseen<M> {
        let (h, z) = (self.seconds, self.z);
        // What the mode adds to the weighted sum of slopes is λ times what that misses of ∫x dt.
        let mut straight = self.parts[0] * MEAN[0];
        for (j, weight) in MEAN.into_iter().enumerate().skip(1) {
            straight += self.parts[j] * weight;
        }
        let linear = self.where_stiff(self.place - straight) * h / z;
        // Of x², the part of the motion that decays: x = a (exp λt − 1).
        let [_, _, e] = self.weights.decays;
        let per = z.reciprocal();
        let mut square = (e - 1.0) * (e - 3.0) * per * 0.5 + 1.0;
        for j in 0..3 {
            let lost = self.weights.decays[j] - 1.0;
            square -= lost * lost * MEAN[j + 1];
        }
        let a = self.parts[0] * per * h;
        Unseen {
            mode: self.mode,
            integrals: [linear, self.where_stiff(a * a * square)],
        }
    }
}

// The exponential weights belong to the own method.
#[cfg(all(test, not(feature = "three-eighths")))]
mod tests;
