//! Cam: its profile with scratches, evaluated fast.

use std::f64::consts::TAU;

use twinrig_document::declaration::{Accepts, Shape, Type, quantity, record};
use twinrig_kernel::{Unit, stream};

use crate::profile::{CamProfile, Lift};
use crate::ranges;

record! {
    /// Scratches of the milling: dents at random angles.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Scratches = "scratches" {
        /// Number of scratches.
        pub count: u32 = COUNT,
        /// Depth \[m\].
        pub depth: f64 = quantity(Unit::Meter, ranges::DEPTH),
        /// Width \[rad\].
        pub width: f64 = quantity(Unit::Radian, ranges::WIDTH),
    }
}

/// Bound of the number of scratches.
const MOST: u64 = 100;
const COUNT: Type<u32> = Type::new(Shape::One(Accepts::Natural(0..=MOST)), |item, _| {
    let count = item.natural()?;
    let number = u32::try_from(count).ok().filter(|_| count <= MOST);
    let message = format!("a cam of {count} scratches");
    number.ok_or_else(|| item.report(message, format!("at most {MOST}")))
});

/// Place at which a cam cannot guide its roller.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the cam is undercut at {degrees:.0}°: the path of the roller's centre turns with a radius of {:.2} mm, less than the roller's {:.2} mm", .radius * 1e3, .roller * 1e3
)]
pub struct Undercut {
    /// Angle of the cam \[°\].
    pub degrees: f64,
    /// Radius of curvature of the path of the roller's centre \[m\].
    pub radius: f64,
    /// Radius of the roller \[m\].
    pub roller: f64,
}

/// Intervals of the table, which fits into the first-level cache. The error of a harmonic lift of
/// 12 mm is 1e-12 m.
const INTERVALS: usize = 512;

/// Cam as a table of fifth-degree polynomials with continuous second derivatives, so that every
/// profile costs the same and needs no transcendental function.
#[derive(Clone, Debug)]
pub(crate) struct Cam {
    /// Coefficients of the lift over each interval, in its share 0 … 1.
    intervals: Vec<[f64; 6]>,
}

impl Scratches {
    /// Returns the angles of the scratches under a seed \[rad\].
    fn angles(&self, seed: u64) -> Vec<f64> {
        let mut random = stream(seed, "bench/cam/scratches");
        (0..self.count).map(|_| TAU * random.unit()).collect()
    }

    /// Returns the lift at an `angle` of a scratch at `place`: −depth (1 − x²)³ within its width.
    fn lift(&self, place: f64, angle: f64) -> Lift {
        let distance = angle - place;
        let turns = (distance / TAU).round();
        let half = 0.5 * self.width;
        let x = (distance - turns * TAU) / half;
        let rest = 1.0 - x * x;
        if rest <= 0.0 {
            return [0.0; 3];
        }
        [
            -self.depth * rest * rest * rest,
            self.depth * 6.0 * x * rest * rest / half,
            self.depth * 6.0 * rest * (1.0 - 5.0 * x * x) / (half * half),
        ]
    }
}

impl Cam {
    pub(crate) fn new(profile: &CamProfile, scratches: &Scratches, seed: u64) -> Self {
        let sampled = profile.sampled();
        let places = scratches.angles(seed);
        let spacing = TAU / INTERVALS as f64;
        let node = |n: usize| {
            let angle = spacing * (n % INTERVALS) as f64;
            let mut lift = sampled.at(angle);
            for place in &places {
                let scratch = scratches.lift(*place, angle);
                for (sum, part) in lift.iter_mut().zip(scratch) {
                    *sum += part;
                }
            }
            [lift[0], lift[1] * spacing, lift[2] * spacing * spacing]
        };
        let interval = |n: usize| quintic(node(n), node(n + 1));
        Self {
            intervals: (0..INTERVALS).map(interval).collect(),
        }
    }

    /// Returns the lift at an angle \[rad\].
    #[inline]
    pub(crate) fn at(&self, angle: f64) -> Lift {
        const PER_RADIAN: f64 = INTERVALS as f64 / TAU;
        let place = angle * PER_RADIAN;
        // Not `floor`, which calls a function on processors without an instruction for it.
        #[expect(
            clippy::cast_possible_truncation,
            reason = "an angle of 2⁵³ intervals is 1e16 rad"
        )]
        let toward_zero = place as i64;
        let below = toward_zero - i64::from((toward_zero as f64) > place);
        let t = place - below as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            reason = "the remainder is the index of an interval"
        )]
        let index = below.rem_euclid(INTERVALS as i64) as usize;
        let [c0, c1, c2, c3, c4, c5] = self.intervals[index];
        [
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            (c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))) * PER_RADIAN,
            (2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)))
                * (PER_RADIAN * PER_RADIAN),
        ]
    }
}

/// Returns the polynomial with these values and derivatives at 0 and 1.
fn quintic(from: Lift, to: Lift) -> [f64; 6] {
    let [y0, v0, a0] = from;
    let [y1, v1, a1] = to;
    let (rise, half) = (y1 - y0 - v0 - 0.5 * a0, 0.5 * (a1 - a0));
    let turn = v1 - v0 - a0;
    [
        y0,
        v0,
        0.5 * a0,
        10.0 * rise - 4.0 * turn + half,
        -15.0 * rise + 7.0 * turn - 2.0 * half,
        6.0 * rise - 3.0 * turn + half,
    ]
}

/// Checks that a roller can follow a profile: where the path of its centre is convex, it turns with
/// a radius of at least the roller's.
///
/// # Errors
/// [`Undercut`] at the place of the least radius.
pub(crate) fn check_curvature(
    profile: &CamProfile,
    base_radius: f64,
    roller: f64,
) -> Result<(), Undercut> {
    let sampled = profile.sampled();
    let radius = |n: u32| {
        let angle = TAU * f64::from(n) / 3600.0;
        let [lift, slope, bend] = sampled.at(angle);
        let r = base_radius + roller + lift;
        let square = r * r + slope * slope;
        let curvature = (r * r + 2.0 * slope * slope - r * bend) / (square * square.sqrt());
        (curvature > 0.0).then(|| (0.1 * f64::from(n), 1.0 / curvature))
    };
    let convex = (0..3600).filter_map(radius);
    let least = convex.min_by(|a, b| a.1.total_cmp(&b.1));
    match least {
        Some((degrees, radius)) if radius < roller => Err(Undercut {
            degrees,
            radius,
            roller,
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Scratches = Scratches {
        count: 0,
        depth: 0.0,
        width: 0.1,
    };

    #[test]
    fn table_is_the_harmonic_lift() {
        let cam = Cam::new(&CamProfile::Harmonic { lift: 12e-3 }, &NONE, 1);
        for n in -500..500 {
            let angle = f64::from(n) * 0.0371;
            let [lift, slope, bend] = cam.at(angle);
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            assert!((lift - 6e-3 * (1.0 - cos)).abs() < 1e-12, "{angle}");
            assert!((slope - 6e-3 * sin).abs() < 1e-9, "{angle}");
            assert!((bend - 6e-3 * cos).abs() < 1e-6, "{angle}");
        }
    }

    #[test]
    fn scratches_depend_on_the_seed_and_are_no_deeper_than_stated() {
        let scratches = Scratches {
            count: 4,
            depth: 20e-6,
            width: 0.1,
        };
        let flat = CamProfile::Harmonic { lift: 0.0 };
        let depths = |seed| {
            let cam = Cam::new(&flat, &scratches, seed);
            let angles = (0..6283).map(|n| f64::from(n) * 1e-3);
            angles.map(|angle| cam.at(angle)[0]).collect::<Vec<_>>()
        };
        let (first, second) = (depths(1), depths(2));
        assert_ne!(first, second);
        let deepest = first.iter().copied().fold(0.0, f64::min);
        // Four scratches may overlap.
        assert!(deepest < -19.9e-6 && deepest > -80.1e-6, "{deepest}");
    }

    #[test]
    fn sharp_cams_are_undercut_and_round_ones_are_not() {
        let round = CamProfile::Harmonic { lift: 12e-3 };
        assert_eq!(check_curvature(&round, 20e-3, 5e-3), Ok(()));
        let mut lifts = vec![0.0; 37];
        lifts[18] = 6e-3;
        let sharp = CamProfile::Table { lifts };
        let error = check_curvature(&sharp, 20e-3, 5e-3).unwrap_err();
        assert!((error.degrees - 180.0).abs() < 1.0, "{error}");
    }
}
