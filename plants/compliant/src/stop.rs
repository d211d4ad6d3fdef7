//! Stops in the angles of the joints: depths that grow without bound towards the pose in which the
//! leg would change its assembly mode, so that no finite energy takes it there.
//!
//! The knee, bent by β between 0 (straight) and π (folded), has a stop at each end. With σ = 1 for
//! the extended and −1 for the bottomed one, and the limit β₀ at which the diagonal has its
//! greatest or its least length `l_d`:
//!
//! ```text
//! u = (1 + σ cos β)/sin β = cot(β/2) or tan(β/2)      |du/dβ| = (1 + u²)/2
//! x = a (u − u₀)                                      a = |dl_d/dβ|₀ · 2/(1 + u₀²)
//! ```
//!
//! At its limit the depth x equals that of the diagonal to first order: the stiffness and the
//! damping are those of its length. The diagonal itself would give way: its slope is zero at both
//! ends.
//!
//! Rod and third link must not come into one line, where the rod is longest or shortest for its
//! diagonal: with w = sin(θ₃ − θ₂) + (lΔ/l₂) sin(θ₃ − θ₁), which is proportional to the derivative
//! of the rod with respect to θ₃, and W = [`LEAST`],
//!
//! ```text
//! x = lΔ (W²/w − W)   for w < W
//! ```

use crate::lanes::{LANES, Lanes, Quad, Simd};

/// Sine below which a stop keeps two links from one line.
pub const LEAST: f64 = 0.1;

/// Sine below which depths grow no more: the energy there exceeds any that a robot has, and trial
/// stages that jump across are rejected by their error.
const TINY: f64 = 1e-6;

/// Least bend of the knee from the straight or the folded leg at which its stops begin \[rad\],
/// for robots whose own limit is closer: there, the diagonal has no slope that the stop could take
/// over.
const BEND_MIN: f64 = 1e-3;

/// Returns W²/w − W of a sine w, and its derivative.
#[inline(always)]
pub fn barrier<L: Lanes>(sine: L) -> [L; 2] {
    let per = sine.max(sine.like(TINY)).reciprocal();
    [
        per * (LEAST * LEAST) - LEAST,
        -(per * per * (LEAST * LEAST)),
    ]
}

/// Least and greatest diagonal, and the sides lΔ and l₂ that enclose the knee \[m\].
#[derive(Debug, Clone, Copy)]
pub struct KneeRange {
    /// Least and greatest length of the diagonal.
    pub diagonal: [f64; 2],
    /// lΔ and l₂.
    pub sides: [f64; 2],
}

impl KneeRange {
    /// Returns cos β at a length of the diagonal.
    fn cosine(&self, length: f64) -> f64 {
        let [p, q] = self.sides;
        (length * length - p * p - q * q) / (2.0 * p * q)
    }

    /// Returns a and u₀ of the stop at a length of the diagonal.
    fn end(&self, sigma: f64, length: f64) -> [f64; 2] {
        let most = 1.0 - 0.5 * BEND_MIN * BEND_MIN;
        let ([p, q], cosine) = (self.sides, self.cosine(length).clamp(-most, most));
        let sine = libm::sqrt((1.0 - cosine) * (1.0 + cosine));
        let slope = p * q * sine / length;
        [
            slope * (1.0 - sigma * cosine),
            (1.0 + sigma * cosine) / sine,
        ]
    }
}

/// Stops at both ends of the knee's range; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy)]
pub struct Ends<T> {
    /// a and u₀ of the extended stop.
    extended: [T; 2],
    /// The same of the bottomed one.
    bottomed: [T; 2],
    /// cos β between the limits.
    middle: T,
}

/// Depth of a stop \[m\], and its derivative with respect to θ₂ − θ₁ \[m/rad\].
#[derive(Debug, Clone, Copy)]
pub struct End<L> {
    /// Depth, negative where it is not reached.
    pub depth: L,
    /// Derivative.
    pub slope: L,
}

impl Ends<Quad> {
    /// Places the stops of four legs side by side.
    pub fn side_by_side(ranges: &[KneeRange; LANES]) -> Self {
        let quads = |sigma: f64, end: usize| {
            let ends = ranges.each_ref().map(|r| r.end(sigma, r.diagonal[end]));
            [0, 1].map(|i| Quad(ends.map(|end| end[i])))
        };
        let middle = |r: &KneeRange| 0.5 * (r.cosine(r.diagonal[0]) + r.cosine(r.diagonal[1]));
        Self {
            extended: quads(1.0, 1),
            bottomed: quads(-1.0, 0),
            middle: Quad(ranges.each_ref().map(middle)),
        }
    }

    /// Loads the stops into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Ends<S::Lanes> {
        Ends {
            extended: simd.load_all(&self.extended),
            bottomed: simd.load_all(&self.bottomed),
            middle: simd.load(self.middle),
        }
    }
}

impl<L: Lanes> Ends<L> {
    /// Returns the stop to which the knee is nearer, for sine and cosine of its bend β, and whether
    /// it is the extended one: at most one is reached.
    #[inline(always)]
    pub fn nearer(&self, [sine, cosine]: [L; 2]) -> (L::Mask, End<L>) {
        let zero = sine.zero();
        let upper = cosine.gt(self.middle);
        let ward = |x: L| x.or(upper, -x);
        let a = self.extended[0].or(upper, self.bottomed[0]);
        let from = self.extended[1].or(upper, self.bottomed[1]);
        let u = (ward(cosine) + 1.0) / sine.max(zero.like(TINY));
        let end = End {
            depth: a * (u - from),
            slope: ward(a * (u * u + 1.0) * 0.5),
        };
        (upper, end)
    }

    /// Returns both stops.
    #[inline(always)]
    pub fn both(&self, [sine, cosine]: [L; 2]) -> [End<L>; 2] {
        let sine = sine.max(sine.like(TINY));
        let bottomed = Self::reached(self.bottomed, sine, -cosine);
        [
            Self::reached(self.extended, sine, cosine),
            End {
                slope: -bottomed.slope,
                ..bottomed
            },
        ]
    }

    /// Returns the stop with a and u₀, for the sine of the bend and the cosine towards it.
    #[inline(always)]
    fn reached([a, from]: [L; 2], sine: L, cosine: L) -> End<L> {
        let u = (cosine + 1.0) / sine;
        End {
            depth: a * (u - from),
            slope: a * (u * u + 1.0) * 0.5,
        }
    }
}

/// Pose of rod and third link.
#[derive(Debug, Clone, Copy)]
pub struct DeadCentre<L> {
    /// lΔ \[m\].
    pub arm: L,
    /// lΔ/l₂.
    pub ratio: L,
    /// Sines of θ₃ − θ₁ and θ₃ − θ₂.
    pub sines: [L; 2],
    /// Their cosines.
    pub cosines: [L; 2],
}

impl<L: Lanes> DeadCentre<L> {
    /// Returns w.
    #[inline(always)]
    fn sine(&self) -> L {
        self.sines[1] + self.ratio * self.sines[0]
    }

    /// Returns whether the stop is reached in any leg.
    #[inline(always)]
    pub fn is_reached(&self) -> bool {
        let sine = self.sine();
        sine.any(sine.like(LEAST).gt(sine))
    }

    /// Returns the depth \[m\], and its gradient with respect to θ₁, θ₂, θ₃ \[m/rad\].
    #[inline(always)]
    pub fn depth(&self) -> (L, [L; 3]) {
        let [value, slope] = barrier(self.sine());
        let slope = self.arm * slope;
        let (first, second) = (self.ratio * self.cosines[0], self.cosines[1]);
        let gradient = [
            -(slope * first),
            -(slope * second),
            slope * (first + second),
        ];
        (self.arm * value, gradient)
    }
}

#[cfg(test)]
mod tests;
