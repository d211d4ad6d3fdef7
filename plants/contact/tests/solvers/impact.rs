//! Impacts: conservation of momentum, restitution and dissipation.

use proptest::prelude::*;
use twinrig_contact::{Bound, Method, Problem, Restitution, SolveError};

use crate::oracle::Case;

const LAWS: [Restitution; 2] = [Restitution::Newton, Restitution::Poisson];

/// Impact of a body with mass matrix M = diag(m), rows J, velocity v before, and bounds of the
/// rows.
#[derive(Debug, Clone)]
struct Collision {
    masses: Vec<f64>,
    j: Vec<Vec<f64>>,
    v: Vec<f64>,
    bounds: Vec<Bound>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Collision {
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

    fn solve(&self, law: Restitution, e: &[f64]) -> Result<(Problem, Vec<f64>), SolveError> {
        let mut problem = self.case().problem();
        problem.impact(law, &self.rates(&self.v), e, Method::Direct)?;
        let after = self.after(problem.unknowns());
        Ok((problem, after))
    }
}

fn collision(friction: bool) -> impl Strategy<Value = Collision> {
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
            Collision {
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
    fn frictionless_impacts_dissipate_and_separate_by_both_laws(collision in collision(false), e in 0.0..=1.0_f64) {
        for law in LAWS {
            let (problem, after) = collision.solve(law, &vec![e; collision.j.len()]).unwrap();
            prop_assert!(collision.energy(&after) <= collision.energy(&collision.v) + 1e-9, "{:?}", law);
            for (row, rate) in collision.rates(&after).iter().enumerate() {
                prop_assert!(*rate > -1e-8, "{:?} closes at {}", law, rate);
                prop_assert!((problem.w(row) - rate).abs() < 1e-8);
                prop_assert!(problem.unknowns()[row] > -1e-9);
            }
        }
    }

    #[test]
    fn poissons_law_dissipates_with_friction_and_different_coefficients(
        collision in collision(true),
        e in proptest::collection::vec(0.0..=1.0_f64, 9),
    ) {
        // Not every problem with friction is solved; most are.
        if let Ok((problem, after)) = collision.solve(Restitution::Poisson, &e[..collision.j.len()]) {
            prop_assert!(collision.energy(&after) <= collision.energy(&collision.v) + 1e-7);
            let rates = collision.rates(&after);
            for contact in 0..collision.j.len() / 3 {
                let p = &problem.unknowns()[3 * contact..3 * contact + 3];
                prop_assert!(rates[3 * contact] > -1e-6);
                let Bound::Disc { friction, .. } = collision.bounds[3 * contact + 1] else { unreachable!() };
                prop_assert!(libm::hypot(p[1], p[2]) <= friction * p[0] + 1e-6);
            }
        }
    }

    #[test]
    fn poissons_law_adds_no_energy_by_any_method(
        collision in collision(true),
        e in proptest::collection::vec(0.0..=1.0_f64, 9),
        sweeps in 1..200_u32,
    ) {
        let rates = collision.rates(&collision.v);
        let sweeps = Method::GaussSeidel { relaxation: 1.0, sweeps, tolerance: 1e-3 };
        for method in [Method::Newton, Method::Direct, sweeps] {
            let mut problem = collision.case().problem();
            if problem.impact(Restitution::Poisson, &rates, &e[..rates.len()], method).is_ok() {
                let [added, exchanged] = problem.impact_energy(&rates);
                let after = collision.after(problem.unknowns());
                let by_velocities = collision.energy(&after) - collision.energy(&collision.v);
                prop_assert!((added - by_velocities).abs() <= 1e-9 * (1.0 + exchanged), "{} {}", added, by_velocities);
                // The tolerance of a solution is relative to the rates, which are of order one, not
                // to its impulses. Sweeps leave an error of the compression, which nothing bounds.
                let allowed = if matches!(method, Method::GaussSeidel { .. }) { 1e-3 } else { 1e-9 };
                prop_assert!(added <= allowed * exchanged + 1e-14, "{:?} adds {} of {}", method, added, exchanged);
            }
        }
    }

    /// The impulses of an approximation are those of both phases: no gap closes by more than the
    /// residual of the error.
    #[test]
    fn truncated_impact_leaves_no_gap_closing_beyond_its_residual(
        collision in collision(false),
        e in 0.1..=1.0_f64,
        sweeps in 1..40_u32,
    ) {
        let rates = collision.rates(&collision.v);
        let method = Method::GaussSeidel { relaxation: 1.0, sweeps, tolerance: 1e-6 };
        let mut problem = collision.case().problem();
        let e = vec![e; rates.len()];
        if let Err(SolveError::Violated { residual, .. }) =
            problem.impact(Restitution::Poisson, &rates, &e, method)
        {
            for row in 0..rates.len() {
                prop_assert!(problem.w(row) >= -residual * (1.0 + 1e-9) - 1e-12, "{} {}", problem.w(row), residual);
            }
        }
    }

    #[test]
    fn unconstrained_momentum_is_conserved_and_bilateral_row_stays_at_rest(collision in collision(false), e in 0.0..=1.0_f64) {
        // No row acts on the last degree of freedom; the first row is a joint that is at rest
        // before.
        let mut collision = collision;
        for row in &mut collision.j {
            *row.last_mut().unwrap() = 0.0;
        }
        collision.bounds[0] = Bound::Free;
        let joint = collision.j[0].clone();
        prop_assume!(dot(&joint, &joint) > 1e-2);
        let along = dot(&joint, &collision.v) / dot(&joint, &joint);
        collision.v.iter_mut().zip(&joint).for_each(|(v, j)| *v -= along * j);
        for law in LAWS {
            if let Ok((_, after)) = collision.solve(law, &vec![e; collision.j.len()]) {
                prop_assert_eq!(after.last(), collision.v.last());
                prop_assert!(dot(&joint, &after).abs() < 1e-6);
                prop_assert!(collision.energy(&after) <= collision.energy(&collision.v) + 1e-9);
            }
        }
    }

    #[test]
    fn single_contact_separates_at_restitution_times_approach_rate(
        mass in 0.1..10.0_f64,
        arm in proptest::collection::vec(-1.0..1.0_f64, 3),
        v in proptest::collection::vec(-1.0..1.0_f64, 3),
        e in 0.0..=1.0_f64,
    ) {
        prop_assume!(dot(&arm, &arm) > 0.1);
        let collision = Collision { masses: vec![mass; 3], j: vec![arm], v, bounds: vec![Bound::NonNegative] };
        let before = collision.rates(&collision.v)[0];
        for law in LAWS {
            let (_, after) = collision.solve(law, &[e]).unwrap();
            let expected = if before < 0.0 { -e * before } else { before };
            prop_assert!((collision.rates(&after)[0] - expected).abs() < 1e-9);
            let (_, elastic) = collision.solve(law, &[1.0]).unwrap();
            prop_assert!((collision.energy(&elastic) - collision.energy(&collision.v)).abs() < 1e-9);
        }
    }

    #[test]
    fn laws_coincide_without_restitution(collision in collision(true)) {
        let e = vec![0.0; collision.j.len()];
        if let (Ok((a, _)), Ok((b, _))) = (collision.solve(LAWS[0], &e), collision.solve(LAWS[1], &e)) {
            prop_assert_eq!(a.unknowns(), b.unknowns());
        }
    }

    #[test]
    fn all_methods_agree_on_impacts(collision in collision(false), e in 0.0..=1.0_f64) {
        let mut case = collision.case();
        for (i, row) in case.g.iter_mut().enumerate() {
            row[i] += 0.1;
        }
        let (rates, e) = (collision.rates(&collision.v), vec![e; collision.j.len()]);
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

/// Rod that slides and falls: friction stops the slide and reverses it within the impact.
const KANE: [f64; 3] = [1.0, -1.8, 0.0];

/// Returns a thin rod of 1 kg and 2 m, at an angle to the ground, whose tip strikes it.
fn rod(angle: f64, friction: f64, v: [f64; 3]) -> Collision {
    let (x, y) = (libm::cos(angle), libm::sin(angle));
    Collision {
        masses: vec![1.0, 1.0, 1.0 / 3.0],
        // The tip is at (−x, −y) from the centre; degrees of freedom: along, up, rotation.
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
fn kanes_rod_gains_energy_by_newtons_law_and_not_by_poissons() {
    let collision = rod(0.6, 0.6, KANE);
    let e = [0.9, 0.0, 0.0];
    let gain = LAWS.map(|law| {
        let (_, after) = collision.solve(law, &e).unwrap();
        collision.energy(&after) / collision.energy(&collision.v) - 1.0
    });
    assert!(gain[0] > 0.01, "{gain:?}");
    assert!(gain[1] < 0.0, "{gain:?}");
}

/// Generates Painlevé's rod, sliding on its tip without approach to the ground. In closed form, for
/// a thin rod of mass m at the angle a (x = cos a, y = sin a), in normal and tangent of its tip:
///
/// ```text
/// m G = | 1 + 3x²   −3xy   |    m² det G = 4
///       |  −3xy    1 + 3y² |
/// ```
///
/// A slide at −v presses the tip down where 1 + 3x² < 3 µ x y. Only sticking ends the impact: P =
/// −G⁻¹ (0, −v) = m v/4 (3xy, 1 + 3x²), which lies in the friction cone for exactly these µ.
fn jammed_rod() -> impl Strategy<Value = (f64, f64, f64)> {
    // Angle, friction relative to the jamming limit, and speed.
    (0.9..1.5_f64, 1.01..3.0_f64, 0.01..10.0_f64)
}

/// Returns the least friction at which a slide presses the rod down.
fn jamming(angle: f64) -> f64 {
    let (x, y) = (libm::cos(angle), libm::sin(angle));
    (1.0 + 3.0 * x * x) / (3.0 * x * y)
}

/// Returns the rod with its tip sliding at a rate and its centre at rest.
fn slide(angle: f64, friction: f64, rate: f64) -> (Problem, [f64; 3]) {
    let problem = rod(angle, friction, [0.0; 3]).case().problem();
    (problem, [0.0, rate, 0.0])
}

proptest! {
    #[test]
    fn jamming_rod_stops_by_closed_form_impulse((angle, share, speed) in jammed_rod()) {
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
    fn rod_with_consistent_contact_forces_receives_no_impulse(
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
    fn impact_without_collision_dissipates_and_leaves_no_gap_closing(collision in collision(true)) {
        // Projects the velocity so that no normal moves, as far as the degrees of freedom permit.
        let mut collision = collision;
        let normals: Vec<Vec<f64>> = collision.j.iter().step_by(3).cloned().collect();
        for _ in 0..200 {
            for normal in &normals {
                let along = dot(normal, &collision.v) / dot(normal, normal);
                collision.v.iter_mut().zip(normal).for_each(|(v, j)| *v -= along * j);
            }
        }
        let mut problem = collision.case().problem();
        let rates = collision.rates(&collision.v);
        prop_assume!(rates.iter().step_by(3).all(|rate| rate.abs() < 1e-7));
        let jammed: Vec<bool> = (0..rates.len()).map(|row| row % 3 == 0).collect();
        if problem.impact_without_collision(&rates, &jammed, Method::Direct).is_ok() {
            let after = collision.after(problem.unknowns());
            prop_assert!(collision.energy(&after) <= collision.energy(&collision.v) + 1e-6);
            for (row, rate) in collision.rates(&after).iter().enumerate().step_by(3) {
                prop_assert!(*rate > -1e-5, "{} closes at {}", row, rate);
            }
        }
    }
}

#[test]
fn different_coefficients_gain_energy_by_newtons_law_and_not_by_poissons() {
    // Two stops that nearly oppose each other, one elastic and one inelastic; one opens as the
    // other closes.
    let j = vec![vec![1.0, 0.2], vec![-1.0, 0.2]];
    let collision = Collision {
        masses: vec![1.0; 2],
        j,
        v: vec![-1.0, 0.0],
        bounds: vec![Bound::NonNegative; 2],
    };
    let gains = LAWS.map(|law| {
        let (_, after) = collision.solve(law, &[1.0, 0.0]).unwrap();
        collision.energy(&after) / collision.energy(&collision.v) - 1.0
    });
    assert!(gains[0] > 0.1, "{gains:?}");
    assert!(gains[1] < 1e-12 && gains[1] > -0.9, "{gains:?}");
}

/// Two feet coupled by friction, one elastic and one inelastic: without the reduction of
/// coefficients, Poisson's law would increase the energy seventyfold.
#[test]
fn poissons_coefficients_are_reduced_to_prevent_energy_gain() {
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
    let collision = Collision {
        masses: vec![1.0; 6],
        j: j.map(Vec::from).to_vec(),
        v: vec![-0.9145, -0.4066, -0.8714, 0.9380, 0.6598, 0.6540],
        bounds: vec![ray, disc(0), second, ray, disc(3), second],
    };
    let (rates, e) = (
        collision.rates(&collision.v),
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
    for method in [Method::Newton, Method::Direct] {
        let mut problem = collision.case().problem();
        problem
            .impact(Restitution::Poisson, &rates, &e, method)
            .unwrap();
        let after = collision.after(problem.unknowns());
        assert!(
            collision.energy(&after) <= collision.energy(&collision.v),
            "{method:?}"
        );
        assert!(collision.rates(&after)[0] > -1e-8 && collision.rates(&after)[3] > -1e-8);
    }
}

#[test]
fn brake_impulse_over_both_phases_is_within_its_interval() {
    // A ball falls on elastic ground and drags a brake of limited force.
    let collision = Collision {
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
    let (problem, after) = collision.solve(Restitution::Poisson, &[1.0, 0.0]).unwrap();
    let brake = problem.unknowns()[1];
    // The brake impulse is +0.3 during the fall and 0.5 less during the rise.
    assert!((brake + 0.2).abs() < 1e-12, "{brake}");
    assert!(after[0] >= 0.0 && collision.energy(&after) <= collision.energy(&collision.v));
}

#[test]
fn all_methods_agree_on_bounce_with_friction() {
    let collision = rod(0.6, 0.2, KANE);
    let rates = collision.rates(&collision.v);
    let answers = [Method::Newton, Method::Direct, crate::agreement::SWEEPS].map(|method| {
        let mut problem = collision.case().problem();
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
fn impact_restores_bounds_and_rates() {
    let collision = rod(0.6, 0.6, KANE);
    let mut problem = collision.case().problem();
    let rates = collision.rates(&collision.v);
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
fn coefficient_outside_its_range_is_an_error() {
    for e in [-0.1, 1.1, f64::NAN] {
        let error = rod(0.6, 0.6, KANE).solve(Restitution::Newton, &[e, 0.0, 0.0]);
        assert!(matches!(
            error,
            Err(SolveError::Parameter {
                what: "restitution",
                ..
            })
        ));
    }
}
