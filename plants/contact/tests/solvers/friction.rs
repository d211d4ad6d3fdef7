//! Contacts with friction: the exact disc, by every method.

use proptest::prelude::*;
use twinrig_contact::{Bound, Method, Problem, SolveError};

use crate::agreement::SWEEPS;
use crate::oracle::Case;

/// Generates normal and two tangents for each of several contacts of a body with as many degrees of
/// freedom as columns.
pub fn contacts(friction: impl Strategy<Value = f64>) -> impl Strategy<Value = Case> {
    (1..=4_usize, 3..=8_usize, friction)
        .prop_flat_map(|(contacts, freedoms, friction)| {
            let any = |n| proptest::collection::vec(-1.0..1.0_f64, n);
            (
                proptest::collection::vec(any(freedoms), 3 * contacts),
                any(3 * contacts),
                Just(friction),
            )
        })
        .prop_map(|(j, b, friction)| {
            let bounds = (0..j.len()).map(|row| match row % 3 {
                0 => Bound::NonNegative,
                1 => Bound::Disc {
                    normal: row - 1,
                    friction,
                },
                _ => Bound::DiscSecond,
            });
            Case::new(&j, b, bounds.collect(), 0.0)
        })
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Returns whether a solution satisfies Coulomb's law by its definition.
fn satisfies_coulomb(case: &Case, z: &[f64]) -> bool {
    const NEAR: f64 = 1e-5;
    let w = case.w(z);
    z.chunks(3).zip(w.chunks(3)).enumerate().all(|(c, (z, w))| {
        let Bound::Disc { friction, .. } = case.bounds[3 * c + 1] else {
            return false;
        };
        let (pull, slip, limit) = (norm(&z[1..]), norm(&w[1..]), friction * z[0]);
        let work = z[1] * w[1] + z[2] * w[2];
        z[0] > -NEAR
            && w[0] > -NEAR
            && (z[0] < NEAR || w[0] < NEAR)
            && pull < limit + NEAR
            && (slip < NEAR || (work + limit * slip).abs() < NEAR * (1.0 + limit))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn solutions_satisfy_coulombs_law(case in contacts(0.0..1.5_f64)) {
        for method in [Method::Newton, Method::Direct, SWEEPS] {
            let mut problem = case.problem();
            if problem.solve_by(method).is_ok() {
                let z = problem.unknowns();
                prop_assert!(z.iter().any(|z| z.abs() > 1e6) || satisfies_coulomb(&case, z), "{:?}: {:?}", method, z);
            }
        }
    }

    #[test]
    fn projection_satisfies_bounds(case in contacts(0.0..1.5_f64), guess in proptest::collection::vec(-1.0..1.0_f64, 12)) {
        let mut problem = case.problem();
        for (row, value) in guess[..case.b.len()].iter().enumerate() {
            problem.guess(row, *value);
        }
        problem.project_onto_bounds();
        let z = problem.unknowns();
        for (c, (z, before)) in z.chunks(3).zip(guess.chunks(3)).enumerate() {
            let Bound::Disc { friction, .. } = case.bounds[3 * c + 1] else { unreachable!() };
            prop_assert!(z[0] == before[0].max(0.0));
            prop_assert!(norm(&z[1..]) <= friction * z[0] * (1.0 + 1e-6));
            if norm(&before[1..]) <= friction * z[0] {
                prop_assert_eq!(&z[1..], &before[1..]);
            }
        }
    }

    #[test]
    fn all_methods_agree_at_low_friction(mut case in contacts(0.0..0.2_f64)) {
        for (i, row) in case.g.iter_mut().enumerate() {
            row[i] += 0.5;
        }
        let mut answers = Vec::new();
        for method in [Method::Newton, Method::Direct, SWEEPS] {
            let mut problem = case.problem();
            problem.solve_by(method).unwrap();
            answers.push(problem.unknowns().to_vec());
        }
        for answer in &answers[1..] {
            for (a, b) in answers[0].iter().zip(answer) {
                prop_assert!((a - b).abs() < 1e-6, "{:?}", answers);
            }
        }
    }
}

/// Deterministic pseudorandom numbers in [−1, 1).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Returns a body on feet whose rates forces could have made, b = G f, so that rest is reachable.
/// Its masses are log-uniform within 10^(±2 `spread`).
fn stoppable(feet: usize, freedoms: usize, spread: f64, number: &mut impl FnMut() -> f64) -> Case {
    let friction = 0.75 * (1.0 + number());
    let bounds = (0..3 * feet).map(|row| match row % 3 {
        0 => Bound::NonNegative,
        1 => Bound::Disc {
            normal: row - 1,
            friction,
        },
        _ => Bound::DiscSecond,
    });
    let roots: Vec<f64> = (0..freedoms)
        .map(|_| libm::pow(10.0, spread * number()))
        .collect();
    let j: Vec<Vec<f64>> = (0..3 * feet)
        .map(|_| roots.iter().map(|root| number() / root).collect())
        .collect();
    let mut case = Case::new(&j, vec![0.0; j.len()], bounds.collect(), 0.0);
    let forces: Vec<f64> = j.iter().map(|_| number()).collect();
    case.b = case.times_g(&forces);
    case
}

// No solution is guaranteed with friction; the problems are deterministic.
#[test]
fn thousand_stoppable_bodies_are_stopped() {
    let mut number = numbers();
    for body in 0..1000 {
        let case = stoppable(1 + body % 4, 3 + body % 6, 0.0, &mut number);
        let mut problem = case.problem();
        let result = problem.solve_by(Method::Direct);
        assert!(result.is_ok(), "{body}: {result:?}");
        assert!(satisfies_coulomb(&case, problem.unknowns()), "{body}");
    }
}

#[test]
fn ill_conditioned_stoppable_bodies_are_solved_exactly_in_994_of_1000() {
    let mut number = numbers();
    let exact = (0..1000).filter(|_| {
        let case = stoppable(4, 6, 1.0, &mut number);
        let greatest = case
            .b
            .iter()
            .fold(0.0_f64, |largest, b| largest.max(b.abs()));
        let solution = case.problem().solve_by(Method::Direct);
        solution.is_ok_and(|solution| solution.residual <= 1e-9 * greatest)
    });
    let exact = exact.count();
    assert!(exact >= 994, "{exact}");
}

#[test]
fn duplicate_foot_slides_like_one() {
    // Elimination encounters an exact zero, and the slide is along none of the pyramid's sides.
    let foot = [[1.0, 0.0, 0.0], [0.25, 1.0, 0.0], [0.0, 0.25, 1.0]].map(Vec::from);
    let disc = |normal| Bound::Disc {
        normal,
        friction: 0.5,
    };
    let (ray, second) = (Bound::NonNegative, Bound::DiscSecond);
    let b = [-1.0, 2.0, 0.75];
    let one = Case::new(&foot, b.to_vec(), vec![ray, disc(0), second], 0.0);
    let two = Case::new(
        &[foot.clone(), foot].concat(),
        [b, b].concat(),
        vec![ray, disc(0), second, ray, disc(3), second],
        0.0,
    );
    let [mut single, mut double] = [one.problem(), two.problem()];
    single.solve_by(Method::Direct).unwrap();
    let solution = double.solve_by(Method::Direct).unwrap();
    assert_eq!(solution.sweeps, 0);
    for row in 0..3 {
        let sum = double.unknowns()[row] + double.unknowns()[row + 3];
        assert!((sum - single.unknowns()[row]).abs() < 1e-8);
    }
}

#[test]
fn sweeps_converge_with_nearly_parallel_tangents() {
    let mut problem = Problem::default();
    problem.reset(3);
    for (i, row) in [[1.43, 0.3, 0.13], [0.3, 1.875, -1.69], [0.13, -1.69, 1.85]]
        .iter()
        .enumerate()
    {
        for (j, &entry) in row.iter().enumerate() {
            problem.set(i, j, entry);
        }
    }
    let normal = 0;
    problem.bound(normal, Bound::NonNegative);
    problem.bound(
        1,
        Bound::Disc {
            normal,
            friction: 0.145,
        },
    );
    problem.offset(0, -0.517);
    problem.offset(2, -0.128);
    for relaxation in [0.5, 1.0, 1.5, 1.9] {
        (0..3).for_each(|row| problem.guess(row, 0.0));
        let method = Method::GaussSeidel {
            relaxation,
            sweeps: 1000,
            tolerance: 1e-9,
        };
        let solution = problem.solve_by(method).unwrap();
        assert!(solution.residual < 1e-9);
    }
}

#[test]
fn painleve_rod_is_not_reported_infeasible() {
    // Painlevé's rod: friction presses it into the ground more than the normal force lifts it.
    let mut problem = Problem::default();
    problem.reset(3);
    for (i, row) in [[1.0, 2.0, 0.0], [2.0, 5.0, 0.0], [0.0, 0.0, 1.0]]
        .iter()
        .enumerate()
    {
        for (j, &entry) in row.iter().enumerate() {
            problem.set(i, j, entry);
        }
    }
    problem.bound(0, Bound::NonNegative);
    problem.bound(
        1,
        Bound::Disc {
            normal: 0,
            friction: 0.8,
        },
    );
    problem.offset(0, -1.0);
    problem.offset(1, 30.0);
    for method in [Method::Newton, Method::Direct, SWEEPS] {
        let result = problem.solve_by(method);
        match result {
            Ok(solution) => assert!(solution.residual < 1e-4 && problem.residual() < 1e-4),
            Err(error) => assert!(!matches!(error, SolveError::Infeasible { .. })),
        }
    }
}
