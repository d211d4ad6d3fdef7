use proptest::prelude::*;

use super::*;
use crate::Element;
use crate::lanes::{Features, Kernel, dispatch};
use twinrig_robot::OneSided;

/// lΔ, l₂ and the range of the diagonal of a small leg \[m\].
const RANGE: KneeRange = KneeRange {
    diagonal: [62.82e-3, 84.1e-3],
    sides: [15e-3, 71.4e-3],
};

/// Depths, slopes and energies of the extended and the bottomed stop at a bend of the knee, and
/// depth and slope of the one that [`Ends::nearer`] chooses.
struct At(f64);

impl Kernel for At {
    type Output = ([[f64; 3]; 2], [f64; 2]);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let ends = Ends::side_by_side(&[RANGE; LANES]).load(simd);
        let side = OneSided {
            stiffness: 100e3,
            damping: 100.0,
            toe_region: 0.2e-3,
        };
        let element = Element::side_by_side([side; LANES]).load(simd);
        let bend = [libm::sin(self.0), libm::cos(self.0)].map(|x| simd.splat(x));
        let first = |lanes: S::Lanes| lanes.quad().0[0];
        let both = ends.both(bend).map(|end| {
            let energy = element.energy(end.depth);
            [first(end.depth), first(end.slope), first(energy)]
        });
        let (_, nearer) = ends.nearer(bend);
        (both, [first(nearer.depth), first(nearer.slope)])
    }
}

fn at(bend: f64) -> ([[f64; 3]; 2], [f64; 2]) {
    dispatch(Features::Detected, At(bend))
}

fn diagonal(bend: f64) -> f64 {
    let [p, q] = RANGE.sides;
    libm::sqrt(p * p + q * q + 2.0 * p * q * libm::cos(bend))
}

/// Bends at which the diagonal has its greatest and its least length.
fn limits() -> [f64; 2] {
    [1, 0].map(|end| libm::acos(RANGE.cosine(RANGE.diagonal[end])))
}

#[test]
fn stops_begin_as_those_of_the_diagonal() {
    for (end, limit) in limits().into_iter().enumerate() {
        let outward = [-1.0, 1.0][end];
        // Depths differ by the second order of the angle.
        let step = 1e-5;
        let beyond = (diagonal(limit + outward * step) - diagonal(limit)).abs();
        assert!(at(limit).0[end][0].abs() < 1e-16);
        let depth = at(limit + outward * step).0[end][0];
        assert!(
            (depth / beyond - 1.0).abs() < 10.0 * step,
            "{depth} {beyond}"
        );
        assert!(at(limit - outward * step).0[end][0] < 0.0);
    }
}

/// A limit at the straight leg, where rounding errors make the cosine 1 or more.
#[test]
fn stops_are_finite_where_the_limit_is_the_straight_leg() {
    let [p, q] = RANGE.sides;
    for length in [p + q, (p + q) * (1.0 + 1e-15), (p + q) * (1.0 - 1e-9)] {
        let [a, from] = KneeRange {
            diagonal: [RANGE.diagonal[0], length],
            ..RANGE
        }
        .end(1.0, length);
        assert!(
            a > 0.0 && (1.0..2.1 / BEND_MIN).contains(&from),
            "{a} {from}"
        );
    }
}

/// 1 kJ lifts a robot of 1 kg by 100 m; a stop of the diagonal has 0.3 J at the straight leg.
#[test]
fn energy_grows_without_bound_towards_the_straight_and_the_folded_leg() {
    for (end, pole) in [0.0, std::f64::consts::PI].into_iter().enumerate() {
        let inward = [1.0, -1.0][end];
        let energies = [0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6].map(|b| at(pole + inward * b).0[end][2]);
        assert!(energies[0] > 10.0 && energies[1] > 1e3);
        for pair in energies[1..].windows(2) {
            // V ~ 1/β² near the pole.
            assert!((pair[1] / pair[0] - 100.0).abs() < 10.0, "{energies:?}");
        }
        // Trial stages beyond are pushed back with all that force.
        let [_, slope, energy] = at(pole - inward * 0.1).0[end];
        assert!(energy >= energies[5] * 0.9 && slope.abs() > 1e6);
    }
}

proptest! {
    #[test]
    fn slopes_are_derivatives_of_depths(bend in 0.02..3.12_f64) {
        let step = 1e-6;
        let (ends, chosen) = at(bend);
        let [after, before] = [step, -step].map(|d| at(bend + d).0);
        for end in 0..2 {
            // The slope is with respect to θ₂ − θ₁ = −β.
            let difference = (before[end][0] - after[end][0]) / (2.0 * step);
            // Third derivative times step²/6, a share of (step/β)²: 3e-9; rounding 1e-16/step.
            prop_assert!((difference / ends[end][1] - 1.0).abs() < 1e-7);
        }
        // At most one is reached, and that one is chosen.
        let reached = usize::from(ends[1][0] > ends[0][0]);
        if ends[reached][0] > 0.0 {
            prop_assert!(ends[1 - reached][0] < 0.0);
            prop_assert_eq!(chosen, [ends[reached][0], ends[reached][1]]);
        } else {
            prop_assert!(chosen[0] <= 0.0);
        }
    }

    #[test]
    fn gradient_at_the_dead_centre_is_that_of_its_depth(
        opening in -0.5..0.5_f64, ankle in 0.01..0.3_f64, folded in any::<bool>(),
    ) {
        let ankle = if folded { std::f64::consts::PI - ankle } else { ankle };
        let angles = [0.3, 0.3 + opening - ankle, 0.3 + opening];
        let (depth, gradient) = dead_centre(angles);
        prop_assume!(depth.abs() < 10.0);
        for i in 0..3 {
            let step = 1e-7;
            let [after, before] = [step, -step].map(|d| {
                let mut moved = angles;
                moved[i] += d;
                dead_centre(moved).0
            });
            let difference = (after - before) / (2.0 * step);
            let size = gradient.iter().fold(1e-3, |a: f64, b| a.max(b.abs()));
            // w is above 2e-5 here: (step/w)² and the rounding of w, each relative.
            prop_assert!((difference - gradient[i]).abs() < 1e-3 * size);
        }
    }
}

/// Depth and gradient of the stop between rod and third link.
fn dead_centre([first, second, third]: [f64; 3]) -> (f64, [f64; 3]) {
    struct Centre([f64; 2]);
    impl Kernel for Centre {
        type Output = (f64, [f64; 3]);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let centre = DeadCentre {
                arm: simd.splat(RANGE.sides[0]),
                ratio: simd.splat(RANGE.sides[0] / RANGE.sides[1]),
                sines: self.0.map(|angle| simd.splat(libm::sin(angle))),
                cosines: self.0.map(|angle| simd.splat(libm::cos(angle))),
            };
            let (depth, gradient) = centre.depth();
            (depth.quad().0[0], gradient.map(|g| g.quad().0[0]))
        }
    }
    dispatch(Features::Detected, Centre([third - first, third - second]))
}
