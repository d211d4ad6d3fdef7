//! Four numbers side by side, one for each leg, in the widest registers that the processor has.
//!
//! The hot code is generic over [`Lanes`] and entered through [`dispatch`], which selects an
//! implementation at run time: registers of 256 bits where the processor has AVX2, two halves of
//! 128 bits elsewhere. Each operation is a single IEEE 754 operation in both, in the same order and
//! never fused, so the bits of a result do not depend on the processor.

mod features;
mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use features::{Features, dispatch};
#[cfg(test)]
pub(crate) use portable::{Numbers, Portable};

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Number of lanes.
pub const LANES: usize = 4;

/// Numbers of four legs in memory.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[repr(align(32))]
pub struct Quad(pub [f64; LANES]);

impl Quad {
    /// Returns the same number four times.
    pub const fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// Returns a vector, followed by zero.
    pub const fn of_three([x, y, z]: [f64; 3]) -> Self {
        Self([x, y, z, 0.0])
    }

    /// Returns the first three numbers.
    #[inline(always)]
    pub fn three(self) -> [f64; 3] {
        let [x, y, z, _] = self.0;
        [x, y, z]
    }
}

/// Four numbers in registers. Constants are plain numbers on the right of an operator.
pub trait Lanes:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// Result of a comparison.
    type Mask: Copy;

    /// Returns another number in all lanes.
    #[must_use]
    fn like(self, value: f64) -> Self;

    /// Returns the numbers in memory.
    fn quad(self) -> Quad;

    /// Returns the square root.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Returns the magnitude.
    #[must_use]
    fn abs(self) -> Self;

    /// Returns whether the number exceeds another.
    fn gt(self, other: Self) -> Self::Mask;

    /// Returns the number where the mask is set, else the other.
    #[must_use]
    fn or(self, mask: Self::Mask, other: Self) -> Self;

    /// Returns whether the mask is set in any lane.
    fn any(self, mask: Self::Mask) -> bool;

    /// Returns the sums of four numbers over their lanes: (a + b) + (c + d).
    #[must_use]
    fn sums(of: [Self; LANES]) -> Self;

    /// Returns zero.
    #[must_use]
    #[inline(always)]
    fn zero(self) -> Self {
        self.like(0.0)
    }

    /// Returns the larger of two numbers; the second where they are equal or not ordered.
    #[must_use]
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.or(self.gt(other), other)
    }

    /// Returns the smaller of two numbers; the second where they are equal or not ordered.
    #[must_use]
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.or(other.gt(self), other)
    }

    /// Returns the number limited to an interval.
    #[must_use]
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    /// Returns the reciprocal.
    #[must_use]
    #[inline(always)]
    fn reciprocal(self) -> Self {
        self.like(1.0) / self
    }

    /// Returns sines and cosines, to two units in the last place of one for arguments up to about
    /// 1e5. If any angle is beyond a quarter of a turn, all are reduced first.
    #[inline(always)]
    fn sin_cos<const M: usize>(angles: [Self; M]) -> ([Self; M], [Self; M]) {
        let mut most = angles[0].abs();
        for angle in &angles[1..] {
            most = most.max(angle.abs());
        }
        if most.any(most.gt(most.like(core::f64::consts::FRAC_PI_2))) {
            return reduced_sin_cos(angles);
        }
        near_zero(angles)
    }
}

/// Returns sines and cosines by reduction to an eighth of a turn.
#[inline(always)]
fn reduced_sin_cos<L: Lanes, const M: usize>(angles: [L; M]) -> ([L; M], [L; M]) {
    /// Adding and subtracting this constant rounds to an integer.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    /// π/2 in three parts of 33 bits and a remainder: the product with a number of quarters below
    /// 2²⁰ is exact.
    const QUARTER: [f64; 3] = [
        1.570_796_326_734_125_6,
        6.077_100_506_303_966e-11,
        2.022_266_248_795_950_6e-21,
    ];
    let (mut rests, mut turns) = (angles, angles);
    for i in 0..M {
        let quarters = (angles[i] * core::f64::consts::FRAC_2_PI + WHOLE) - WHOLE;
        rests[i] =
            ((angles[i] - quarters * QUARTER[0]) - quarters * QUARTER[1]) - quarters * QUARTER[2];
        // −2, −1, 0, 1 or 2 quarters.
        turns[i] = quarters - ((quarters * 0.25 + WHOLE) - WHOLE) * 4.0;
    }
    let (mut sines, mut cosines) = near_zero(rests);
    for i in 0..M {
        let (q, square) = (turns[i], turns[i] * turns[i]);
        let odd = square * (square.like(4.0) - square) * (1.0 / 3.0);
        let upright = (odd.like(1.0) - odd) * (square.like(1.0) - square * 0.5);
        let turned = odd * q;
        (sines[i], cosines[i]) = (
            upright * sines[i] + turned * cosines[i],
            upright * cosines[i] - turned * sines[i],
        );
    }
    (sines, cosines)
}

/// Returns sines and cosines of at most π/2: by polynomials from Chebyshev interpolation, with
/// errors of 2e-18 and 7e-17.
#[inline(always)]
fn near_zero<L: Lanes, const M: usize>(angles: [L; M]) -> ([L; M], [L; M]) {
    const SINE: [f64; 8] = [
        2.731_428_986_122_616e-15,
        -7.643_969_031_052_769e-13,
        1.605_897_727_281_551e-10,
        -2.505_210_761_638_459_5e-8,
        2.755_731_921_915_843e-6,
        -1.984_126_984_125_495_5e-4,
        8.333_333_333_333_316e-3,
        -1.666_666_666_666_666_6e-1,
    ];
    const COSINE: [f64; 7] = [
        4.646_409_715_227_79e-14,
        -1.146_625_047_853_674_5e-11,
        2.087_668_151_390_718_4e-9,
        -2.755_731_857_284_831_5e-7,
        2.480_158_729_891_088_8e-5,
        -1.388_888_888_888_476_3e-3,
        4.166_666_666_666_666e-2,
    ];
    let mut squares = angles;
    for square in &mut squares {
        *square = *square * *square;
    }
    let (mut sines, mut cosines) = (horner(squares, SINE), horner(squares, COSINE));
    for i in 0..M {
        let (angle, z) = (angles[i], squares[i]);
        sines[i] = angle + angle * (z * sines[i]);
        let half = z * 0.5 - z * z * cosines[i];
        cosines[i] = half.like(1.0) - half;
    }
    (sines, cosines)
}

/// Returns a polynomial of several numbers, its highest coefficient first.
#[inline(always)]
fn horner<L: Lanes, const M: usize, const C: usize>(of: [L; M], coefficients: [f64; C]) -> [L; M] {
    let mut values = [of[0].like(coefficients[0]); M];
    for coefficient in &coefficients[1..] {
        for (value, z) in values.iter_mut().zip(&of) {
            *value = *value * *z + *coefficient;
        }
    }
    values
}

/// Source of lanes: a processor feature that was found at run time.
pub trait Simd: Copy {
    /// The numbers.
    type Lanes: Lanes;

    /// Whether four numbers share one register: others hold too few to keep a long task in them, so
    /// that inlining it gains nothing.
    const ARE_WIDE: bool;

    /// Returns the same number in all lanes.
    fn splat(self, value: f64) -> Self::Lanes;

    /// Returns numbers from memory.
    fn load(self, quad: Quad) -> Self::Lanes;

    /// Returns several numbers from memory.
    #[inline(always)]
    fn load_all<const M: usize>(self, quads: &[Quad; M]) -> [Self::Lanes; M] {
        // `array::map` is not always inlined.
        let mut all = [self.splat(0.0); M];
        for (lanes, quad) in all.iter_mut().zip(quads) {
            *lanes = self.load(*quad);
        }
        all
    }

    /// Runs a task as a function of its own with the same registers: for one that is too long to be
    /// inlined in several places.
    fn call<T: Task>(self, task: T) -> T::Output;
}

/// Part of a computation in lanes.
pub trait Task {
    /// Result.
    type Output;

    /// Computes the result. To be inlined always, as everything it calls.
    fn run(self) -> Self::Output;
}

/// Kernel with its registers.
struct Entry<K, S> {
    kernel: K,
    simd: S,
}

impl<K: Kernel, S: Simd> Task for Entry<K, S> {
    type Output = K::Output;

    #[inline(always)]
    fn run(self) -> K::Output {
        self.kernel.run(self.simd)
    }
}

/// Computation in lanes, generic over their implementation.
pub trait Kernel {
    /// Result.
    type Output;

    /// Computes the result. To be inlined always, as everything it calls.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

#[cfg(test)]
mod tests;
