//! Positions of particles, as vectors of `argmin`.

use argmin_math::{ArgminAdd, ArgminMinMax, ArgminMul, ArgminRandom, ArgminSub, ArgminZeroLike};
use rand::Rng;

/// Places along the ranges of all parameters, or differences of places. The range is from 0 to 1,
/// and a place beyond is its mirror image: a particle that passes a bound is reflected elastically.
///
/// `argmin` limits positions to the bounds and keeps velocities. Particles that left the range then
/// lie *on* a bound, draw each other along it and never leave it: with six parameters and an
/// optimum close to the bounds of four, 99 % of searches stop there. Here positions have no limits,
/// and attraction is towards the nearest image of a point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Places(pub(crate) Vec<f64>);

/// Share of the range at a place: its image from 0 to 1.
pub(crate) fn share(place: f64) -> f64 {
    let turn = place.rem_euclid(2.0);
    if turn > 1.0 { 2.0 - turn } else { turn }
}

/// Difference from a place to the nearest image of another.
fn towards(other: f64, place: f64) -> f64 {
    let shortest = |difference: f64| difference - 2.0 * (0.5 * difference).round();
    let (image, mirrored) = (shortest(other - place), shortest(-other - place));
    if mirrored.abs() < image.abs() {
        mirrored
    } else {
        image
    }
}

impl Places {
    fn with(&self, other: &Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        let pairs = self.0.iter().zip(&other.0);
        Self(pairs.map(|(&one, &other)| combine(one, other)).collect())
    }
}

impl ArgminAdd<Self, Self> for Places {
    fn add(&self, other: &Self) -> Self {
        self.with(other, |one, other| one + other)
    }
}

impl ArgminSub<Self, Self> for Places {
    fn sub(&self, other: &Self) -> Self {
        self.with(other, towards)
    }
}

impl ArgminMul<f64, Self> for Places {
    fn mul(&self, factor: &f64) -> Self {
        Self(self.0.iter().map(|it| it * factor).collect())
    }
}

impl ArgminZeroLike for Places {
    fn zero_like(&self) -> Self {
        Self(vec![0.0; self.0.len()])
    }
}

/// No limits: places beyond the bounds are images.
impl ArgminMinMax for Places {
    fn min(place: &Self, _: &Self) -> Self {
        place.clone()
    }

    fn max(place: &Self, _: &Self) -> Self {
        place.clone()
    }
}

impl ArgminRandom for Places {
    /// Uniform numbers between two values, from 53 bits each: those of the kernel's streams, and
    /// not of
    /// `rand`, whose distributions change with its releases.
    fn rand_from_range<R: Rng>(one: &Self, other: &Self, numbers: &mut R) -> Self {
        let pairs = one.0.iter().zip(&other.0);
        let draw = |(&one, &other): (&f64, &f64)| {
            let unit = (numbers.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0);
            one + (other - one) * unit
        };
        Self(pairs.map(draw).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against the nearest of all images nearby.
        #[test]
        fn difference_leads_to_the_nearest_image(other in -9.0..9.0_f64, place in -9.0..9.0_f64) {
            let difference = towards(other, place);
            let near = |one: f64, other: f64| (one - other).abs() < 1e-12;
            prop_assert!(near(share(place + difference), share(other)));
            let images = (-10..=10).flat_map(|turn| [1.0, -1.0].map(|sign| {
                sign * share(other) + 2.0 * f64::from(turn)
            }));
            let nearest = images.map(|image| (image - place).abs()).fold(f64::INFINITY, f64::min);
            prop_assert!(near(difference.abs(), nearest));
        }

        #[test]
        fn shares_are_mirrored(inside in 0.0..=1.0_f64, turn in -3..3_i32) {
            for place in [inside, -inside] {
                let share = share(place + 2.0 * f64::from(turn));
                prop_assert!((share - inside).abs() < 1e-14);
                prop_assert!((0.0..=1.0).contains(&share));
            }
        }
    }
}
