//! Agreement of all methods with the oracle, with each other, and from different guesses.

use proptest::prelude::*;
use twinrig_contact::{Bound, Method, Problem, SolveError};

use crate::oracle::Case;

pub const SWEEPS: Method = Method::GaussSeidel {
    relaxation: 1.2,
    sweeps: 20_000,
    tolerance: 1e-10,
};

/// Reduced limit of sweeps for problems that may have no solution.
const FEW_SWEEPS: Method = Method::GaussSeidel {
    relaxation: 1.2,
    sweeps: 500,
    tolerance: 1e-10,
};

fn bound() -> impl Strategy<Value = Bound> {
    prop_oneof![
        5 => Just(Bound::NonNegative),
        1 => Just(Bound::Free),
        1 => (-3..=2_i32, 0..=3_i32).prop_map(|(low, width)| Bound::Between {
            low: f64::from(low),
            high: f64::from(low + width),
        }),
        1 => (-2..=2_i32).prop_map(|low| Bound::Between {
            low: f64::from(low),
            high: f64::INFINITY,
        }),
        1 => (-2..=2_i32).prop_map(|high| Bound::Between {
            low: f64::NEG_INFINITY,
            high: f64::from(high),
        }),
    ]
}

/// Generates rows of small integers: frequently dependent, repeated, zero or tied.
pub fn degenerate() -> impl Strategy<Value = Case> {
    (1..=7_usize, 1..=5_usize)
        .prop_flat_map(|(n, rank)| {
            let integers = |n, largest: i32| {
                proptest::collection::vec((-largest..=largest).prop_map(f64::from), n)
            };
            (
                proptest::collection::vec(integers(rank, 2), n),
                integers(n, 3),
                proptest::collection::vec(bound(), n),
            )
        })
        .prop_map(|(j, b, bounds)| Case::new(&j, b, bounds, 0.0))
}

/// Generates rows of arbitrary numbers with a small compliance, so that the solution is unique.
fn regular() -> impl Strategy<Value = Case> {
    (1..=7_usize, 1..=7_usize)
        .prop_flat_map(|(n, rank)| {
            let any = |n| proptest::collection::vec(-1.0..1.0_f64, n);
            (
                proptest::collection::vec(any(rank), n),
                any(n),
                proptest::collection::vec(bound(), n),
            )
        })
        .prop_map(|(j, b, bounds)| Case::new(&j, b, bounds, 0.01))
}

fn max_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |largest, (a, b)| (a - b).abs().max(largest))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn direct_solver_finds_solution_or_proves_infeasibility(case in degenerate()) {
        let mut problem = case.problem();
        let result = problem.solve_by(Method::Direct);
        if let Some(z) = case.solution() {
            let solution = result.unwrap();
            prop_assert!(case.satisfies_conditions(problem.unknowns()), "{:?}", problem.unknowns());
            prop_assert!(solution.residual < 1e-9 && solution.residual == problem.residual());
            // The forces may not be unique, but their effect is, up to the cancellation of large
            // forces.
            let greatest = max_difference(&z, &vec![0.0; z.len()]);
            prop_assert!(max_difference(&case.w(&z), &case.w(problem.unknowns())) < 1e-8 * (1.0 + greatest));
        } else if result.is_ok() {
            // Nearly singular: the oracle's elimination lost too many digits.
            prop_assert!(case.satisfies_conditions(problem.unknowns()), "{:?}", problem.unknowns());
        } else {
            let infeasible = matches!(result, Err(SolveError::Infeasible { .. }));
            prop_assert!(infeasible, "{:?}", result);
            let proof = problem.unknowns();
            prop_assert!(case.times_g(proof).iter().all(|w| w.abs() < 1e-7));
            prop_assert!(proof.iter().zip(&case.b).map(|(v, b)| v * b).sum::<f64>() < -1e-7);
            for (v, bound) in proof.iter().zip(&case.bounds) {
                match bound {
                    Bound::Between { high, .. } if high.is_finite() => prop_assert!(*v < 1e-7),
                    Bound::NonNegative | Bound::Between { .. } => prop_assert!(*v > -1e-7),
                    _ => {}
                }
            }
        }
    }

}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn sweeps_agree_with_oracle(case in degenerate()) {
        let mut problem = case.problem();
        let result = problem.solve_by(FEW_SWEEPS);
        match case.solution() {
            // Convergence is slow for nearly parallel rows, hence the loose tolerance.
            Some(z) => if result.is_ok() {
                prop_assert!(max_difference(&case.w(&z), &case.w(problem.unknowns())) < 1e-3);
            },
            None => prop_assert!(result.is_err()),
        }
    }

    // Elimination of a singular G may leave 1e-16 in place of zero. Forces of 1e15 then solve the
    // rounded problem; their magnitude reveals the case.
    #[test]
    fn newton_errors_on_singular_problems_have_huge_forces(case in degenerate()) {
        let mut problem = case.problem();
        let solved = problem.solve().is_ok();
        if solved && problem.unknowns().iter().all(|z| z.abs() < 1e6) {
            let z = case.solution().unwrap();
            prop_assert!(max_difference(&case.w(&z), &case.w(problem.unknowns())) < 1e-3);
        }
    }

    #[test]
    fn all_methods_agree_on_unique_solution(
        case in regular(),
        guess in proptest::collection::vec(-5.0..5.0_f64, 7),
    ) {
        let z = case.solution().unwrap();
        for method in [Method::Newton, Method::Direct, SWEEPS] {
            let mut problem = case.problem();
            let solution = problem.solve_by(method).unwrap();
            prop_assert!(max_difference(&z, problem.unknowns()) < 1e-5, "{:?}: {:?} {:?}", method, z, problem.unknowns());
            prop_assert!((solution.residual - problem.residual()).abs() < 1e-12);

            // From another guess, and with the memory of another problem.
            for (i, guess) in guess.iter().take(case.len()).enumerate() {
                problem.guess(i, *guess);
            }
            problem.solve_by(method).unwrap();
            prop_assert!(max_difference(&z, problem.unknowns()) < 1e-5, "{:?} from a guess", method);
        }
    }

    #[test]
    fn reused_problem_matches_new_one(first in degenerate(), second in degenerate()) {
        for method in [Method::Newton, Method::Direct, FEW_SWEEPS] {
            let mut used = Problem::default();
            first.fill(&mut used);
            let _ = used.solve_by(method);
            second.fill(&mut used);
            let mut new = second.problem();
            prop_assert_eq!(used.solve_by(method), new.solve_by(method));
            prop_assert_eq!(used.unknowns(), new.unknowns());
        }
    }
}
