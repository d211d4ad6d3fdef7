//! All methods agree with the oracle, with each other, and with themselves from another start.

use proptest::prelude::*;
use twinrig_contact::{Bound, Method, Problem, Unsolved};

use crate::oracle::Case;

pub const SWEEPS: Method = Method::GaussSeidel {
    relaxation: 1.2,
    sweeps: 20_000,
    tolerance: 1e-10,
};

/// As many sweeps as a problem that may have no solution deserves.
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

/// Rows of small whole numbers: dependent, repeated, zero, tied, as often as not.
pub fn rough() -> impl Strategy<Value = Case> {
    (1..=7_usize, 1..=5_usize)
        .prop_flat_map(|(n, rank)| {
            let whole =
                |n, most: i32| proptest::collection::vec((-most..=most).prop_map(f64::from), n);
            (
                proptest::collection::vec(whole(rank, 2), n),
                whole(n, 3),
                proptest::collection::vec(bound(), n),
            )
        })
        .prop_map(|(j, b, bounds)| Case::new(&j, b, bounds, 0.0))
}

/// Rows of any numbers, with a little softness: one solution.
fn smooth() -> impl Strategy<Value = Case> {
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

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn the_direct_solver_finds_a_solution_or_proves_that_there_is_none(case in rough()) {
        let mut problem = case.problem();
        let result = problem.solve_by(Method::Direct);
        if let Some(z) = case.solution() {
            let solution = result.unwrap();
            prop_assert!(case.holds(problem.unknowns()), "{:?}", problem.unknowns());
            prop_assert!(solution.residual < 1e-9 && solution.residual == problem.residual());
            // The forces may be several, what they do is one; to the digits that great forces leave.
            let greatest = apart(&z, &vec![0.0; z.len()]);
            prop_assert!(apart(&case.w(&z), &case.w(problem.unknowns())) < 1e-8 * (1.0 + greatest));
        } else if result.is_ok() {
            // Nearly singular: the oracle's own elimination lost too much.
            prop_assert!(case.holds(problem.unknowns()), "{:?}", problem.unknowns());
        } else {
            let infeasible = matches!(result, Err(Unsolved::Infeasible { .. }));
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
    fn sweeps_reach_what_there_is_to_reach(case in rough()) {
        let mut problem = case.problem();
        let result = problem.solve_by(FEW_SWEEPS);
        match case.solution() {
            // Slowly, where rows nearly say the same; but never something else.
            Some(z) => if result.is_ok() {
                prop_assert!(apart(&case.w(&z), &case.w(problem.unknowns())) < 1e-3);
            },
            None => prop_assert!(result.is_err()),
        }
    }

    // What elimination leaves of a singular G may be 1e-16 in place of zero. Forces of 1e15 then solve the problem that
    // was rounded, and it is by them that one can tell.
    #[test]
    fn newton_is_wrong_about_singular_problems_by_forces_beyond_measure_only(case in rough()) {
        let mut problem = case.problem();
        let solved = problem.solve().is_ok();
        if solved && problem.unknowns().iter().all(|z| z.abs() < 1e6) {
            let z = case.solution().unwrap();
            prop_assert!(apart(&case.w(&z), &case.w(problem.unknowns())) < 1e-3);
        }
    }

    #[test]
    fn all_methods_agree_where_the_solution_is_one(
        case in smooth(),
        guess in proptest::collection::vec(-5.0..5.0_f64, 7),
    ) {
        let z = case.solution().unwrap();
        for method in [Method::Newton, Method::Direct, SWEEPS] {
            let mut problem = case.problem();
            let solution = problem.solve_by(method).unwrap();
            prop_assert!(apart(&z, problem.unknowns()) < 1e-5, "{:?}: {:?} {:?}", method, z, problem.unknowns());
            prop_assert!((solution.residual - problem.residual()).abs() < 1e-12);

            // From another start, and with the memory of another problem.
            for (i, guess) in guess.iter().take(case.len()).enumerate() {
                problem.guess(i, *guess);
            }
            problem.solve_by(method).unwrap();
            prop_assert!(apart(&z, problem.unknowns()) < 1e-5, "{:?} from a guess", method);
        }
    }

    #[test]
    fn a_used_problem_answers_like_a_new_one(first in rough(), second in rough()) {
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
