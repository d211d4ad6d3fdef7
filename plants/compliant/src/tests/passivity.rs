//! Passivity of soles: friction gives back no more energy than it took, whatever load and motion
//! do.
#![allow(
    clippy::inline_always,
    reason = "code with wider registers has to be inlined into the function that enables them"
)]

use proptest::prelude::*;
use twinrig_compliant::lanes::{Features, Kernel, LANES, Lanes, Quad, Simd, dispatch};
use twinrig_compliant::{Approach, Element, Sole};
use twinrig_robot::OneSided;

const FRICTION: f64 = 0.6;
const DEFLECTION: f64 = 0.3e-3;
/// Force at the greatest depth of a cycle, 1 mm \[N\].
const LOAD: f64 = 9.0;
/// Energy scale of a bristle, µ F zₛ \[J\].
const SCALE: f64 = FRICTION * LOAD * DEFLECTION;

fn sole() -> Sole<Quad> {
    let side = OneSided {
        stiffness: 10e3,
        damping: 40.0,
        toe_region: 0.2e-3,
    };
    let element = Element::side_by_side([side; LANES]);
    Sole::new(element, FRICTION, &[DEFLECTION; LANES])
}

/// Depth and displacement along the ground at the end of a segment of a cycle \[m\].
type Knot = [f64; 3];

/// Closed cycles of depth and displacement, one in each lane, between whose knots the motion is
/// smooth and rests at the knots.
#[derive(Debug)]
struct Cycles {
    knots: [Vec<Knot>; LANES],
    /// Duration of a segment, by lane \[s\].
    seconds: [f64; LANES],
    substeps: u32,
    /// Number of rounds.
    rounds: usize,
}

/// Motion of the sole at an instant.
struct Motion<L> {
    depth: L,
    depth_rate: L,
    slip: [L; 2],
}

/// Result of the cycles, by lane.
#[derive(Debug)]
struct Outcome {
    /// Least work done on the sole along the ground since the start, at rest and relaxed \[J\].
    least_work: Quad,
    /// Work along the ground, dissipated energy and stored energy of the bristle at the end \[J\].
    work: Quad,
    dissipated: Quad,
    stored: Quad,
    /// Least dissipated power, the element's included \[W\].
    least_power: Quad,
    /// Greatest ratio of friction to load.
    ratio: Quad,
    /// Deflection of the bristle at the end \[m\].
    bristle: [Quad; 2],
}

impl Cycles {
    /// Returns the motion in segment `segment`, at the share `u` of its duration.
    #[inline(always)]
    fn motion<S: Simd>(&self, simd: S, segment: usize, u: f64) -> Motion<S::Lanes> {
        let (blend, rate) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
        let quad = |of: &dyn Fn(usize) -> f64| simd.load(Quad(std::array::from_fn(of)));
        let [from, to] = [0, 1]
            .map(|k| move |lane: usize| self.knots[lane][(segment + k) % self.knots[lane].len()]);
        let rates =
            |i: usize| quad(&|lane| (to(lane)[i] - from(lane)[i]) * rate / self.seconds[lane]);
        Motion {
            depth: quad(&|lane| from(lane)[0] + (to(lane)[0] - from(lane)[0]) * blend),
            depth_rate: rates(0),
            slip: [rates(1), rates(2)],
        }
    }
}

impl Kernel for &Cycles {
    type Output = Outcome;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Outcome {
        let sole = sole().load(simd);
        let zero = simd.splat(0.0);
        let slope = |motion: &Motion<S::Lanes>, bristle: [S::Lanes; 2]| {
            let grip = sole.grip(&Approach {
                gap: -motion.depth,
                gap_rate: -motion.depth_rate,
                slip: motion.slip,
                bristle,
            });
            let [a, b] = grip.tangential;
            let work = -(a * motion.slip[0] + b * motion.slip[1]);
            let ratio = (a * a + b * b).sqrt() / grip.normal.max(zero.like(1e-300));
            let element = sole.element.press(motion.depth, motion.depth_rate);
            let [x, y] = grip.bristle_rate;
            let powers = [x, y, work, grip.dissipated - element.dissipated];
            (powers, grip.dissipated, ratio)
        };
        let mut sums = [zero; 4];
        let (mut least_work, mut least_power, mut most_ratio) = (zero, zero, zero);
        let segments = self.knots[0].len() * self.rounds;
        let step = simd.load(Quad(self.seconds)) * (1.0 / f64::from(self.substeps));
        for segment in 0..segments {
            for substep in 0..self.substeps {
                let at = |share: f64| {
                    self.motion(
                        simd,
                        segment,
                        (f64::from(substep) + share) / f64::from(self.substeps),
                    )
                };
                let [begin, middle, end] = [0.0, 0.5, 1.0].map(at);
                let bristle = |slope: &[S::Lanes; 4], share: f64| {
                    [0, 1].map(|i| sums[i] + slope[i] * step * share)
                };
                let (k1, power, ratio) = slope(&begin, [sums[0], sums[1]]);
                let (k2, ..) = slope(&middle, bristle(&k1, 0.5));
                let (k3, ..) = slope(&middle, bristle(&k2, 0.5));
                let (k4, ..) = slope(&end, bristle(&k3, 1.0));
                for i in 0..4 {
                    sums[i] += (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * step * (1.0 / 6.0);
                }
                least_work = least_work.min(sums[2]);
                least_power = least_power.min(power);
                most_ratio = most_ratio.max(ratio);
            }
        }
        let depth = self.motion(simd, segments - 1, 1.0).depth;
        let [x, y, work, dissipated] = sums;
        let stored = sole.energy(depth, [x, y]) - sole.element.energy(depth);
        Outcome {
            least_work: least_work.quad(),
            work: work.quad(),
            dissipated: dissipated.quad(),
            stored: stored.quad(),
            least_power: least_power.quad(),
            ratio: most_ratio.quad(),
            bristle: [x.quad(), y.quad()],
        }
    }
}

fn run(cycles: &Cycles) -> Outcome {
    dispatch(Features::Detected, cycles)
}

/// The simplest cycle that a bristle scaled by the load alone turns into an engine: it is stretched
/// under a light load, the load grows, the foot returns under it, and the load falls.
#[test]
fn load_that_grows_while_the_bristle_is_stretched_makes_no_energy() {
    let (light, heavy, stretched) = (0.2e-3, 1e-3, 0.6e-3);
    let knots = vec![
        [light, 0.0, 0.0],
        [light, stretched, 0.0],
        [heavy, stretched, 0.0],
        [heavy, stretched - 0.25e-3, 0.0],
        [light, stretched - 0.25e-3, 0.0],
    ];
    let lanes = [0, 1, 2, 3].map(|_| knots.clone());
    let outcome = run(&Cycles {
        knots: lanes,
        seconds: [1e-3, 3e-3, 10e-3, 30e-3],
        substeps: 2000,
        rounds: 1,
    });
    let per_scale = outcome.least_work.0.map(|work| work / SCALE);
    assert!(per_scale.iter().all(|work| *work > -1e-6), "{per_scale:?}");
}

prop_compose! {
    /// A depth from 0.5 mm above the ground to 1 mm below, and a place within 1 mm.
    fn knot()(depth in -0.5e-3..1e-3_f64, place in proptest::array::uniform2(-0.5e-3..0.5e-3_f64))
        -> Knot
    {
        [depth, place[0], place[1]]
    }
}

prop_compose! {
    fn cycles()(
        knots in proptest::array::uniform4(proptest::collection::vec(knot(), 6)),
        seconds in proptest::array::uniform4(0.5e-3..30e-3_f64),
    ) -> Cycles {
        Cycles { knots, seconds, substeps: 100, rounds: 1 }
    }
}

proptest! {
    // Four cycles a case.
    #![proptest_config(ProptestConfig::with_cases(2500))]
    #[test]
    fn closed_cycles_of_load_and_motion_take_energy(cycles in cycles()) {
        let outcome = run(&cycles);
        for lane in 0..LANES {
            let of = |quad: Quad| quad.0[lane];
            // The laws hold at each instant, whatever the integration errs by.
            prop_assert!(of(outcome.least_power) >= 0.0, "{outcome:?}");
            prop_assert!(of(outcome.ratio) <= FRICTION * (1.0 + 1e-12), "{outcome:?}");
            let deflection = libm::hypot(of(outcome.bristle[0]), of(outcome.bristle[1]));
            prop_assert!(deflection <= DEFLECTION * (1.0 + 1e-3), "{outcome:?}");
            // Work is stored or dissipated; within the error of the integration.
            let residual = of(outcome.work) - of(outcome.stored) - of(outcome.dissipated);
            prop_assert!(residual.abs() < 1e-4 * SCALE, "{} {outcome:?}", residual / SCALE);
            prop_assert!(of(outcome.least_work) > -1e-4 * SCALE, "{outcome:?}");
        }
    }
}
