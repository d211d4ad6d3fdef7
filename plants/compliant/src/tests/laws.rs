//! Laws of elements and soles: energy, passivity, the cone of friction.
#![allow(
    clippy::inline_always,
    reason = "code with wider registers has to be inlined into the function that enables them"
)]

use proptest::prelude::*;
use twinrig_compliant::lanes::{Features, Kernel, Lanes, Quad, Simd, dispatch};
use twinrig_compliant::{Approach, Element, Sole};
use twinrig_robot::OneSided;

const FRICTION: f64 = 0.6;
const DEFLECTION: f64 = 0.3e-3;

fn element() -> Element<Quad> {
    let side = OneSided {
        stiffness: 10e3,
        damping: 40.0,
        toe_region: 0.2e-3,
    };
    Element::side_by_side([side; 4])
}

/// Force, dissipated power and energy of an element at a depth and a rate.
struct Press(f64, f64);

impl Kernel for Press {
    type Output = [f64; 3];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [f64; 3] {
        let (element, depth) = (element().load(simd), simd.splat(self.0));
        let press = element.press(depth, simd.splat(self.1));
        [press.force, press.dissipated, element.energy(depth)].map(|lanes| lanes.quad().0[0])
    }
}

/// Motion of a foot: gap, slip and bristle.
#[derive(Debug, Clone, Copy)]
struct Foot {
    gap: f64,
    slip: [f64; 2],
    bristle: [f64; 2],
}

/// Normal force, tangential force and rate of the bristle under a foot.
struct Grip(Foot);

impl Kernel for Grip {
    type Output = (f64, [f64; 2], [f64; 2]);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let both = |pair: [f64; 2]| [simd.splat(pair[0]), simd.splat(pair[1])];
        let sole = Sole::new(element(), FRICTION, &[DEFLECTION; 4]).load(simd);
        let grip = sole.grip(&Approach {
            gap: simd.splat(self.0.gap),
            gap_rate: simd.splat(0.0),
            slip: both(self.0.slip),
            bristle: both(self.0.bristle),
        });
        let first = |lanes: S::Lanes| lanes.quad().0[0];
        let pair = |[a, b]: [S::Lanes; 2]| [first(a), first(b)];
        (
            first(grip.normal),
            pair(grip.tangential),
            pair(grip.bristle_rate),
        )
    }
}

fn press(depth: f64, rate: f64) -> [f64; 3] {
    dispatch(Features::Detected, Press(depth, rate))
}

fn grip(foot: Foot) -> (f64, [f64; 2], [f64; 2]) {
    dispatch(Features::Detected, Grip(foot))
}

proptest! {
    #[test]
    fn elastic_force_is_the_gradient_of_the_energy(depth in -1e-3..2e-3_f64) {
        let step = 1e-7;
        let slope = (press(depth + step, 0.0)[2] - press(depth - step, 0.0)[2]) / (2.0 * step);
        // The second derivative jumps at the end of the toe region: k/δ · step².
        prop_assert!((press(depth, 0.0)[0] - slope).abs() < 1e-5);
    }

    #[test]
    fn element_pushes_and_dissipates(depth in -1e-3..2e-3_f64, rate in -3.0..3.0_f64) {
        let [force, dissipated, energy] = press(depth, rate);
        prop_assert!(force >= 0.0 && dissipated >= 0.0 && energy >= 0.0);
        if depth <= 0.0 {
            prop_assert_eq!([force, dissipated, energy], [0.0; 3]);
        }
    }

    #[test]
    fn friction_stays_in_its_cone(
        gap in -1e-3..1e-3_f64,
        slip in proptest::array::uniform2(-2.0..2.0_f64),
        bristle in proptest::array::uniform2(-1e-3..1e-3_f64),
    ) {
        let (normal, [ahead, left], _) = grip(Foot { gap, slip, bristle });
        prop_assert!(libm::hypot(ahead, left) <= FRICTION * normal * (1.0 + 1e-12));
        // At rest it opposes the bristle.
        let (_, [ahead, left], _) = grip(Foot { gap, slip: [0.0; 2], bristle });
        prop_assert!(ahead * bristle[0] <= 0.0 && left * bristle[1] <= 0.0);
    }

    #[test]
    fn sliding_foot_is_held_back_by_coulomb_friction(
        speed in 0.01..2.0_f64, direction in -3.1..3.1_f64,
    ) {
        let along = [libm::cos(direction), libm::sin(direction)];
        let (slip, bristle) = (along.map(|x| speed * x), along.map(|x| DEFLECTION * x));
        let (normal, force, rate) = grip(Foot { gap: -0.5e-3, slip, bristle });
        for k in 0..2 {
            prop_assert!((force[k] + FRICTION * normal * along[k]).abs() < 1e-12 * normal);
            prop_assert!(rate[k].abs() < 1e-12 * speed);
        }
    }

    #[test]
    fn foot_at_rest_does_not_creep(bristle in proptest::array::uniform2(-0.2e-3..0.2e-3_f64)) {
        let foot = Foot { gap: -0.3e-3, slip: [0.0; 2], bristle };
        prop_assert_eq!(grip(foot).2, [0.0; 2]);
        // And a displaced one takes its bristle along, by the load's share of S: 2 N of 2.25 N.
        let moved = grip(Foot { slip: [1e-3, -2e-3], bristle: [0.0; 2], ..foot });
        for (rate, slip) in moved.2.into_iter().zip([1e-3, -2e-3]) {
            prop_assert!((rate - slip * (2.0 / 2.25)).abs() < 1e-15);
        }
    }

    #[test]
    fn bristle_of_a_foot_above_the_ground_relaxes(
        gap in 0.0..5e-3_f64, slip in proptest::array::uniform2(-2.0..2.0_f64),
    ) {
        let (normal, force, rate) = grip(Foot { gap, slip, bristle: [1e-4, -1e-4] });
        prop_assert_eq!((normal, force), (0.0, [0.0; 2]));
        prop_assert!(rate[0] < 0.0 && rate[1] > 0.0);
    }

    /// A foot that lands in motion slides at once, before its bristle is stretched.
    #[test]
    fn light_load_of_a_relaxed_foot_is_held_back(
        speed in 0.5..2.0_f64, direction in -3.1..3.1_f64, gap in -20e-6..-1e-6_f64,
    ) {
        let along = [libm::cos(direction), libm::sin(direction)];
        let slip = along.map(|x| speed * x);
        let (normal, force, _) = grip(Foot { gap, slip, bristle: [0.0; 2] });
        // At a fifth of εδ a fifth of the load is the bristle's; v/√(v² + v₀²) > 0.99.
        let opposed = -(force[0] * along[0] + force[1] * along[1]);
        prop_assert!(opposed > 0.79 * FRICTION * normal, "{opposed} {normal}");
    }
}
