//! Number types of the equations: one leg, four legs in lanes, or either with a derivative.

mod dual;

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

pub(crate) use dual::Dual;
pub(crate) use wide::f64x4 as Lanes;

/// A number, or several in independent lanes.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + core::fmt::Debug
{
    /// Returns the same number in all lanes.
    fn splat(value: f64) -> Self;

    /// Returns the square root.
    fn sqrt(self) -> Self;

    /// Returns the sum over the lanes, in a fixed order.
    fn sum(self) -> Self::Sum;

    /// Returns sine and cosine, to a unit in the last place for arguments up to about 1e5.
    fn sin_cos(self) -> (Self, Self);

    /// Returns the number limited to an interval.
    fn clamped(self, low: Self, high: Self) -> Self;

    /// Returns the number where its magnitude exceeds `width`, else zero.
    fn beyond(self, width: Self) -> Self;

    /// Returns zero for zero, one otherwise.
    fn nonzero_mask(self) -> Self;

    /// Scalar of this type: the sum of the lanes.
    type Sum: Real<Sum = Self::Sum>;

    /// Returns the plain number of the first lane.
    fn plain(self) -> f64;

    /// Returns one scalar in all lanes.
    fn broadcast(value: Self::Sum) -> Self;

    /// Returns the scalar of one lane.
    fn lane(self, lane: usize) -> Self::Sum;

    /// Returns the same with another scalar in one lane.
    fn with_lane(self, lane: usize, value: Self::Sum) -> Self;

    /// Returns zero.
    fn zero() -> Self {
        Self::splat(0.0)
    }
}

impl Real for f64 {
    type Sum = Self;

    fn splat(value: f64) -> Self {
        value
    }

    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }

    fn sum(self) -> f64 {
        self
    }

    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }

    fn clamped(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    fn beyond(self, width: Self) -> Self {
        if self.abs() > width { self } else { 0.0 }
    }

    fn nonzero_mask(self) -> Self {
        if self == 0.0 { 0.0 } else { 1.0 }
    }

    fn plain(self) -> f64 {
        self
    }

    fn broadcast(value: f64) -> Self {
        value
    }

    fn lane(self, _: usize) -> f64 {
        self
    }

    fn with_lane(self, _: usize, value: f64) -> Self {
        value
    }
}

impl Real for Lanes {
    type Sum = f64;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        let [a, b, c, d] = self.to_array();
        (a + b) + (c + d)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }

    #[inline(always)]
    fn clamped(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    #[inline(always)]
    fn beyond(self, width: Self) -> Self {
        self.abs().simd_gt(width).bitselect(self, Self::splat(0.0))
    }

    #[inline(always)]
    fn nonzero_mask(self) -> Self {
        let zero = Self::splat(0.0);
        self.simd_eq(zero).bitselect(zero, Self::splat(1.0))
    }

    #[inline(always)]
    fn plain(self) -> f64 {
        self.to_array()[0]
    }

    #[inline(always)]
    fn broadcast(value: f64) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.to_array()[lane]
    }

    #[inline(always)]
    fn with_lane(self, lane: usize, value: f64) -> Self {
        let mut lanes = self.to_array();
        lanes[lane] = value;
        Self::new(lanes)
    }
}

/// Numbers of all legs at once.
pub(crate) trait Wide: Real {
    /// Converts from plain numbers.
    fn of(lanes: Lanes) -> Self;
}

impl Wide for Lanes {
    #[inline(always)]
    fn of(lanes: Lanes) -> Self {
        lanes
    }
}

impl Wide for Dual<Lanes> {
    fn of(value: Lanes) -> Self {
        Self {
            value,
            slope: Lanes::zero(),
        }
    }
}

/// Returns sine and cosine by reduction to an eighth of a turn and the polynomials of fdlibm.
/// Quadrants are selected by exact products with zeros and ones, which are available in lanes.
#[inline(always)]
fn sin_cos<R: Real>(x: R) -> (R, R) {
    /// Adding and subtracting this constant rounds to an integer.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    /// π/2 in three parts of 33 bits and a remainder: the product with a number of quarters below
    /// 2²⁰ is exact.
    const QUARTER: [f64; 3] = [
        1.570_796_326_734_125_6,
        6.077_100_506_303_966e-11,
        2.022_266_248_795_950_6e-21,
    ];
    let whole = R::splat(WHOLE);
    let quarters = (x * R::splat(core::f64::consts::FRAC_2_PI) + whole) - whole;
    let [first, second, third] = QUARTER.map(R::splat);
    let r = ((x - quarters * first) - quarters * second) - quarters * third;
    let (sine, cosine) = near_zero(r);
    // −2, −1, 0, 1 or 2 quarters.
    let q = quarters - R::splat(4.0) * ((quarters * R::splat(0.25) + whole) - whole);
    let square = q * q;
    let odd = square * (R::splat(4.0) - square) * R::splat(1.0 / 3.0);
    let upright = (R::splat(1.0) - odd) * (R::splat(1.0) - R::splat(0.5) * square);
    let turned = odd * q;
    (
        upright * sine + turned * cosine,
        upright * cosine - turned * sine,
    )
}

/// Returns sine and cosine of at most π/4.
#[inline(always)]
fn near_zero<R: Real>(r: R) -> (R, R) {
    const SINE: [f64; 6] = [
        1.589_690_995_211_55e-10,
        -2.505_076_025_340_686_3e-8,
        2.755_731_370_707_006_8e-6,
        -1.984_126_982_985_795e-4,
        8.333_333_333_322_49e-3,
        -1.666_666_666_666_663_2e-1,
    ];
    const COSINE: [f64; 6] = [
        -1.135_964_755_778_819_5e-11,
        2.087_572_321_298_175e-9,
        -2.755_731_435_139_066_3e-7,
        2.480_158_728_947_673e-5,
        -1.388_888_888_887_411e-3,
        4.166_666_666_666_66e-2,
    ];
    let z = r * r;
    let horner = |coefficients: [f64; 6]| {
        let mut sum = R::splat(coefficients[0]);
        for c in &coefficients[1..] {
            sum = sum * z + R::splat(*c);
        }
        sum
    };
    (
        r + r * (z * horner(SINE)),
        R::splat(1.0) - (z * R::splat(0.5) - z * z * horner(COSINE)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sin_cos_matches_libm(x in -1000.0..1000.0_f64) {
            let (sine, cosine) = Real::sin_cos(x);
            // Two units in the last place of one: the error of libm is below one.
            prop_assert!((sine - libm::sin(x)).abs() < 3e-16 && (cosine - libm::cos(x)).abs() < 3e-16);
        }

        #[test]
        fn lanes_match_scalars(x in proptest::array::uniform4(-10.0..10.0_f64)) {
            let (sines, cosines) = Real::sin_cos(Lanes::new(x));
            for (i, x) in x.into_iter().enumerate() {
                let (sine, cosine) = Real::sin_cos(x);
                prop_assert_eq!((sines.to_array()[i], cosines.to_array()[i]), (sine, cosine));
            }
        }

        #[test]
        fn dual_slopes_match_differences(x in 0.1..3.0_f64) {
            let f = |x: Dual<f64>| { let (s, c) = x.sin_cos(); (s * s * x.sqrt() - c / x) * Dual::splat(0.5) };
            let at = |value| f(Dual { value, slope: 1.0 });
            let difference = (at(x + 1e-6).value - at(x - 1e-6).value) / 2e-6;
            prop_assert!((at(x).slope - difference).abs() < 1e-7 * (1.0 + 1.0 / (x * x)));
        }
    }
}
