//! Impacts: what they keep, what they may take, and what they must not give.

use proptest::prelude::*;
use twinrig_contact::{Bound, Method, Problem, Restitution, Unsolved};

use crate::oracle::Case;

const LAWS: [Restitution; 2] = [Restitution::Newton, Restitution::Poisson];

/// A body of masses M = diag(m) with rows J, its rates v before, and what the rows are.
#[derive(Debug, Clone)]
struct Hit {
    masses: Vec<f64>,
    j: Vec<Vec<f64>>,
    v: Vec<f64>,
    bounds: Vec<Bound>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Hit {
    fn case(&self) -> Case {
        let roots: Vec<Vec<f64>> = self
            .j
            .iter()
            .map(|row| {
                row.iter()
                    .zip(&self.masses)
                    .map(|(j, m)| j / m.sqrt())
                    .collect()
            })
            .collect();
        Case::new(&roots, vec![0.0; self.j.len()], self.bounds.clone(), 0.0)
    }

    fn rates(&self, v: &[f64]) -> Vec<f64> {
        self.j.iter().map(|row| dot(row, v)).collect()
    }

    fn energy(&self, v: &[f64]) -> f64 {
        v.iter()
            .zip(&self.masses)
            .map(|(v, m)| 0.5 * m * v * v)
            .sum()
    }

    /// v⁺ = v⁻ + M⁻¹ Jᵀ P.
    fn after(&self, impulses: &[f64]) -> Vec<f64> {
        let mut v = self.v.clone();
        for (row, p) in self.j.iter().zip(impulses) {
            for ((v, j), m) in v.iter_mut().zip(row).zip(&self.masses) {
                *v += j * p / m;
            }
        }
        v
    }

    fn solve(&self, law: Restitution, e: &[f64]) -> Result<(Problem, Vec<f64>), Unsolved> {
        let mut problem = self.case().problem();
        problem.impact(law, &self.rates(&self.v), e, Method::Direct)?;
        let after = self.after(problem.unknowns());
        Ok((problem, after))
    }
}

fn hit(friction: bool) -> impl Strategy<Value = Hit> {
    (1..=3_usize, 3..=7_usize, 0.0..1.0_f64)
        .prop_flat_map(move |(contacts, freedoms, mu)| {
            let rows = if friction { 3 * contacts } else { contacts };
            let any = |n| proptest::collection::vec(-1.0..1.0_f64, n);
            (
                proptest::collection::vec(0.2..2.0_f64, freedoms),
                proptest::collection::vec(any(freedoms), rows),
                any(freedoms),
                Just(mu),
            )
        })
        .prop_map(move |(masses, j, v, mu)| {
            let bounds = (0..j.len()).map(|row| match row % 3 {
                1 if friction => Bound::Disc {
                    normal: row - 1,
                    friction: mu,
                },
                2 if friction => Bound::DiscSecond,
                _ => Bound::NonNegative,
            });
            Hit {
                bounds: bounds.collect(),
                masses,
                j,
                v,
            }
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn without_friction_neither_law_gives_energy_and_both_separate(hit in hit(false), e in 0.0..=1.0_f64) {
        for law in LAWS {
            let (problem, after) = hit.solve(law, &vec![e; hit.j.len()]).unwrap();
            prop_assert!(hit.energy(&after) <= hit.energy(&hit.v) + 1e-9, "{:?}", law);
            for (row, rate) in hit.rates(&after).iter().enumerate() {
                prop_assert!(*rate > -1e-8, "{:?} closes at {}", law, rate);
                prop_assert!((problem.w(row) - rate).abs() < 1e-8);
                prop_assert!(problem.unknowns()[row] > -1e-9);
            }
        }
    }

    #[test]
    fn poissons_law_with_friction_and_unlike_coefficients_gives_no_energy(
        hit in hit(true),
        e in proptest::collection::vec(0.0..=1.0_f64, 9),
    ) {
        // Some problems with friction have no solution that is found; most have.
        if let Ok((problem, after)) = hit.solve(Restitution::Poisson, &e[..hit.j.len()]) {
            prop_assert!(hit.energy(&after) <= hit.energy(&hit.v) + 1e-7);
            let rates = hit.rates(&after);
            for contact in 0..hit.j.len() / 3 {
                let p = &problem.unknowns()[3 * contact..3 * contact + 3];
                prop_assert!(rates[3 * contact] > -1e-6);
                let Bound::Disc { friction, .. } = hit.bounds[3 * contact + 1] else { unreachable!() };
                prop_assert!(libm::hypot(p[1], p[2]) <= friction * p[0] + 1e-6);
            }
        }
    }

    #[test]
    fn momentum_that_no_row_touches_is_kept_and_a_bilateral_row_stays_at_rest(hit in hit(false), e in 0.0..=1.0_f64) {
        // The last freedom is made no row's business; the first row is a joint that does not move before.
        let mut hit = hit;
        for row in &mut hit.j {
            *row.last_mut().unwrap() = 0.0;
        }
        hit.bounds[0] = Bound::Free;
        let joint = hit.j[0].clone();
        prop_assume!(dot(&joint, &joint) > 1e-2);
        let along = dot(&joint, &hit.v) / dot(&joint, &joint);
        hit.v.iter_mut().zip(&joint).for_each(|(v, j)| *v -= along * j);
        for law in LAWS {
            if let Ok((_, after)) = hit.solve(law, &vec![e; hit.j.len()]) {
                prop_assert_eq!(after.last(), hit.v.last());
                prop_assert!(dot(&joint, &after).abs() < 1e-6);
                prop_assert!(hit.energy(&after) <= hit.energy(&hit.v) + 1e-9);
            }
        }
    }

    #[test]
    fn one_contact_gives_back_its_share(
        mass in 0.1..10.0_f64,
        arm in proptest::collection::vec(-1.0..1.0_f64, 3),
        v in proptest::collection::vec(-1.0..1.0_f64, 3),
        e in 0.0..=1.0_f64,
    ) {
        prop_assume!(dot(&arm, &arm) > 0.1);
        let hit = Hit { masses: vec![mass; 3], j: vec![arm], v, bounds: vec![Bound::NonNegative] };
        let before = hit.rates(&hit.v)[0];
        for law in LAWS {
            let (_, after) = hit.solve(law, &[e]).unwrap();
            let expected = if before < 0.0 { -e * before } else { before };
            prop_assert!((hit.rates(&after)[0] - expected).abs() < 1e-9);
            let (_, elastic) = hit.solve(law, &[1.0]).unwrap();
            prop_assert!((hit.energy(&elastic) - hit.energy(&hit.v)).abs() < 1e-9);
        }
    }

    #[test]
    fn without_restitution_the_laws_are_one(hit in hit(true)) {
        let e = vec![0.0; hit.j.len()];
        if let (Ok((a, _)), Ok((b, _))) = (hit.solve(LAWS[0], &e), hit.solve(LAWS[1], &e)) {
            prop_assert_eq!(a.unknowns(), b.unknowns());
        }
    }

    #[test]
    fn all_methods_give_the_same_impact(hit in hit(false), e in 0.0..=1.0_f64) {
        let mut case = hit.case();
        for (i, row) in case.g.iter_mut().enumerate() {
            row[i] += 0.1;
        }
        let (rates, e) = (hit.rates(&hit.v), vec![e; hit.j.len()]);
        for law in LAWS {
            let answers = [Method::Newton, Method::Direct, crate::agreement::SWEEPS].map(|method| {
                let mut problem = case.problem();
                problem.impact(law, &rates, &e, method).unwrap();
                problem.unknowns().to_vec()
            });
            for answer in &answers[1..] {
                for (a, b) in answer.iter().zip(&answers[0]) {
                    prop_assert!((a - b).abs() < 1e-6, "{:?}", answers);
                }
            }
        }
    }
}

/// A rod that slides and falls: friction stops the slide and turns it back within the impact.
const KANE: [f64; 3] = [1.0, -1.8, 0.0];

/// A thin rod of 1 kg and 2 m, at an angle to the ground, whose tip strikes it.
fn rod(angle: f64, friction: f64, v: [f64; 3]) -> Hit {
    let (x, y) = (libm::cos(angle), libm::sin(angle));
    Hit {
        masses: vec![1.0, 1.0, 1.0 / 3.0],
        // The tip is at (−x, −y) from the middle; freedoms: along, up, turning.
        j: vec![vec![0.0, 1.0, -x], vec![1.0, 0.0, y], vec![0.0, 0.0, 0.0]],
        v: v.to_vec(),
        bounds: vec![
            Bound::NonNegative,
            Bound::Disc {
                normal: 0,
                friction,
            },
            Bound::DiscSecond,
        ],
    }
}

#[test]
fn newtons_law_with_friction_gives_energy_to_a_rod_that_slides_into_the_ground_and_poissons_does_not()
 {
    let hit = rod(0.6, 0.6, KANE);
    let e = [0.9, 0.0, 0.0];
    let gain = LAWS.map(|law| {
        let (_, after) = hit.solve(law, &e).unwrap();
        hit.energy(&after) / hit.energy(&hit.v) - 1.0
    });
    assert!(gain[0] > 0.01, "{gain:?}");
    assert!(gain[1] < 0.0, "{gain:?}");
}

/// Painlevé's rod slides on its tip, which does not approach the ground. By hand, for a thin rod of mass m at the angle a
/// (x = cos a, y = sin a), in normal and tangent of its tip:
///
/// ```text
/// m G = | 1 + 3x²   −3xy   |    m² det G = 4    a slide at −v presses it down where 1 + 3x² < 3 µ x y
///       |  −3xy    1 + 3y² |
/// ```
///
/// Nothing but sticking ends the impact: P = −G⁻¹ (0, −v) = m v/4 (3xy, 1 + 3x²), which lies in the cone for just those µ.
fn jammed_rod() -> impl Strategy<Value = (f64, f64, f64)> {
    // The angle, friction as a share of what it takes, and the speed.
    (0.9..1.5_f64, 1.01..3.0_f64, 0.01..10.0_f64)
}

/// The least friction at which a slide presses the rod down.
fn jamming(angle: f64) -> f64 {
    let (x, y) = (libm::cos(angle), libm::sin(angle));
    (1.0 + 3.0 * x * x) / (3.0 * x * y)
}

/// The rod with its tip at a rate along the ground, and the middle at rest.
fn slide(angle: f64, friction: f64, rate: f64) -> (Problem, [f64; 3]) {
    let problem = rod(angle, friction, [0.0; 3]).case().problem();
    (problem, [0.0, rate, 0.0])
}

proptest! {
    #[test]
    fn a_rod_that_jams_stops_by_the_impulse_that_is_found_by_hand((angle, share, speed) in jammed_rod()) {
        let (x, y) = (libm::cos(angle), libm::sin(angle));
        for method in [Method::Newton, Method::Direct] {
            let (mut problem, before) = slide(angle, share * jamming(angle), -speed);
            problem.impact_without_collision(&before, &[true, false, false], method).unwrap();
            let impulses = [0.75 * x * y * speed, 0.25 * (1.0 + 3.0 * x * x) * speed];
            for (row, expected) in impulses.into_iter().enumerate() {
                let found = problem.unknowns()[row];
                prop_assert!((found - expected).abs() < 1e-9 * speed, "{:?}: {} of {}", method, found, expected);
                prop_assert!(problem.w(row).abs() < 1e-9 * speed, "{:?}: {}", method, problem.w(row));
            }
        }
    }

    #[test]
    fn a_rod_that_forces_hold_or_that_slides_the_other_way_is_left_alone(
        (angle, _, speed) in jammed_rod(),
        share in 0.0..0.98_f64,
    ) {
        for (share, rate) in [(share, -speed), (share, speed), (1.5, speed)] {
            let (mut problem, before) = slide(angle, share * jamming(angle), rate);
            problem.impact_without_collision(&before, &[true, false, false], Method::Newton).unwrap();
            let left = problem.unknowns().iter().map(|impulse| impulse.abs()).fold(0.0, f64::max);
            prop_assert!(left < 1e-9 * speed, "{:?} at {} of {}", problem.unknowns(), rate, share);
        }
    }

    #[test]
    fn an_impact_without_collision_gives_no_energy_and_leaves_nothing_closing(hit in hit(true)) {
        // The velocity is made one at which no normal moves, as far as there are freedoms to.
        let mut hit = hit;
        let normals: Vec<Vec<f64>> = hit.j.iter().step_by(3).cloned().collect();
        for _ in 0..200 {
            for normal in &normals {
                let along = dot(normal, &hit.v) / dot(normal, normal);
                hit.v.iter_mut().zip(normal).for_each(|(v, j)| *v -= along * j);
            }
        }
        let mut problem = hit.case().problem();
        let rates = hit.rates(&hit.v);
        prop_assume!(rates.iter().step_by(3).all(|rate| rate.abs() < 1e-7));
        let jammed: Vec<bool> = (0..rates.len()).map(|row| row % 3 == 0).collect();
        if problem.impact_without_collision(&rates, &jammed, Method::Direct).is_ok() {
            let after = hit.after(problem.unknowns());
            prop_assert!(hit.energy(&after) <= hit.energy(&hit.v) + 1e-6);
            for (row, rate) in hit.rates(&after).iter().enumerate().step_by(3) {
                prop_assert!(*rate > -1e-5, "{} closes at {}", row, rate);
            }
        }
    }
}

#[test]
fn unlike_coefficients_make_newtons_law_give_energy_and_are_lowered_by_poissons() {
    // Two stops that nearly oppose each other, one elastic and one not, which opens as the other closes.
    let j = vec![vec![1.0, 0.2], vec![-1.0, 0.2]];
    let hit = Hit {
        masses: vec![1.0; 2],
        j,
        v: vec![-1.0, 0.0],
        bounds: vec![Bound::NonNegative; 2],
    };
    let gains = LAWS.map(|law| {
        let (_, after) = hit.solve(law, &[1.0, 0.0]).unwrap();
        hit.energy(&after) / hit.energy(&hit.v) - 1.0
    });
    assert!(gains[0] > 0.1, "{gains:?}");
    assert!(gains[1] < 1e-12 && gains[1] > -0.9, "{gains:?}");
}

/// Two feet that friction couples, one elastic and one not: by Poisson's law as it stands the energy would grow to
/// seventy times what it was. This is why the coefficients are lowered.
#[test]
fn poissons_coefficients_are_lowered_where_they_would_give_energy() {
    let j = [
        [0.9895, 0.4206, 0.2781, -0.8155, -0.2164, -0.6914],
        [0.4828, 0.3639, -0.1065, -0.6244, 0.3691, 0.5394],
        [0.7748, -0.5781, 0.0067, -0.0161, 0.7060, -0.8629],
        [-0.4772, -0.3085, 0.8838, -0.3093, -0.1805, 0.2878],
        [-0.1320, 0.8063, 0.5477, -0.7428, -0.6011, 0.0116],
        [0.5673, 0.0641, 0.3949, -0.7646, -0.4221, 0.5168],
    ];
    let disc = |normal| Bound::Disc {
        normal,
        friction: 2.08,
    };
    let (ray, second) = (Bound::NonNegative, Bound::DiscSecond);
    let hit = Hit {
        masses: vec![1.0; 6],
        j: j.map(Vec::from).to_vec(),
        v: vec![-0.9145, -0.4066, -0.8714, 0.9380, 0.6598, 0.6540],
        bounds: vec![ray, disc(0), second, ray, disc(3), second],
    };
    let (rates, e) = (hit.rates(&hit.v), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for method in [Method::Newton, Method::Direct] {
        let mut problem = hit.case().problem();
        problem
            .impact(Restitution::Poisson, &rates, &e, method)
            .unwrap();
        let after = hit.after(problem.unknowns());
        assert!(hit.energy(&after) <= hit.energy(&hit.v), "{method:?}");
        assert!(hit.rates(&after)[0] > -1e-8 && hit.rates(&after)[3] > -1e-8);
    }
}

#[test]
fn a_brake_takes_no_more_than_its_interval_over_both_phases() {
    // A ball that falls on an elastic ground, and whose fall drags a brake that can hold little.
    let hit = Hit {
        masses: vec![1.0],
        j: vec![vec![1.0], vec![1.0]],
        v: vec![-1.0],
        bounds: vec![
            Bound::NonNegative,
            Bound::Between {
                low: -0.2,
                high: 0.3,
            },
        ],
    };
    let (problem, after) = hit.solve(Restitution::Poisson, &[1.0, 0.0]).unwrap();
    let brake = problem.unknowns()[1];
    // It holds up the fall by 0.3 and the rise by as much and 0.2 more.
    assert!((brake + 0.2).abs() < 1e-12, "{brake}");
    assert!(after[0] >= 0.0 && hit.energy(&after) <= hit.energy(&hit.v));
}

#[test]
fn friction_of_a_bounce_is_the_same_by_every_method() {
    let hit = rod(0.6, 0.2, KANE);
    let rates = hit.rates(&hit.v);
    let answers = [Method::Newton, Method::Direct, crate::agreement::SWEEPS].map(|method| {
        let mut problem = hit.case().problem();
        problem
            .impact(Restitution::Poisson, &rates, &[0.5, 0.0, 0.0], method)
            .unwrap();
        problem.unknowns().to_vec()
    });
    for answer in &answers {
        assert!(answer[0] > 0.1);
        for (a, b) in answer.iter().zip(&answers[0]) {
            assert!((a - b).abs() < 1e-7, "{answers:?}");
        }
    }
}

#[test]
fn bounds_and_rates_are_as_before_afterwards() {
    let hit = rod(0.6, 0.6, KANE);
    let mut problem = hit.case().problem();
    let rates = hit.rates(&hit.v);
    let once = problem.impact(
        Restitution::Poisson,
        &rates,
        &[0.5, 0.0, 0.0],
        Method::Newton,
    );
    let first = problem.unknowns().to_vec();
    let again = problem.impact(
        Restitution::Poisson,
        &rates,
        &[0.5, 0.0, 0.0],
        Method::Newton,
    );
    assert!(once.is_ok() && again.is_ok());
    for (a, b) in first.iter().zip(problem.unknowns()) {
        assert!((a - b).abs() < 1e-12);
    }
}

#[test]
fn coefficients_have_limits() {
    for e in [-0.1, 1.1, f64::NAN] {
        let error = rod(0.6, 0.6, KANE).solve(Restitution::Newton, &[e, 0.0, 0.0]);
        assert!(matches!(
            error,
            Err(Unsolved::Parameter {
                what: "restitution",
                ..
            })
        ));
    }
}
