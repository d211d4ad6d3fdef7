//! Degenerate problems: redundant, empty and contradictory constraints.

use twinrig_contact::{Bound, Method, Problem, SolveError};

use crate::agreement::SWEEPS;
use crate::oracle::Case;

const METHODS: [Method; 3] = [Method::Newton, Method::Direct, SWEEPS];

fn rays(j: &[Vec<f64>], b: &[f64]) -> Case {
    Case::new(j, b.to_vec(), vec![Bound::NonNegative; b.len()], 0.0)
}

#[test]
fn table_on_four_legs_is_in_equilibrium() {
    let corner = |x: f64, y: f64| vec![1.0, x, y];
    let j = [
        corner(1.0, 1.0),
        corner(1.0, -1.0),
        corner(-1.0, 1.0),
        corner(-1.0, -1.0),
    ];
    let case = rays(&j, &[-9.81; 4]);
    for method in [Method::Direct, SWEEPS] {
        let mut problem = case.problem();
        let solution = problem.solve_by(method).unwrap();
        assert!(case.satisfies_conditions(problem.unknowns()) && solution.residual < 1e-8);
        assert!((problem.unknowns().iter().sum::<f64>() - 9.81).abs() < 1e-8);
    }
}

#[test]
fn twelve_identical_stops_act_as_one() {
    let case = rays(&vec![vec![2.0]; 12], &[-1.0; 12]);
    let mut problem = case.problem();
    let solution = problem.solve_by(Method::Direct).unwrap();
    assert!((problem.unknowns().iter().sum::<f64>() - 0.25).abs() < 1e-12);
    assert!(solution.pivots <= 24, "{}", solution.pivots);
}

#[test]
fn immobile_row_is_feasible_if_offset_is_non_negative() {
    for (offset, feasible) in [(1.0, true), (0.0, true), (-1.0, false)] {
        let case = rays(&[vec![0.0], vec![1.0]], &[offset, -2.0]);
        for method in METHODS {
            let mut problem = case.problem();
            let result = problem.solve_by(method);
            assert_eq!(result.is_ok(), feasible, "{method:?} {offset}: {result:?}");
            if feasible {
                assert_eq!(problem.unknowns()[0], 0.0);
                assert!((problem.unknowns()[1] - 2.0).abs() < 1e-9);
            } else if method == Method::Direct {
                assert!(matches!(
                    result,
                    Err(SolveError::Infeasible { size: 2, .. })
                ));
                assert_eq!(problem.unknowns(), &[1.0, 0.0]);
            }
        }
    }
}

#[test]
fn sweeps_discard_guess_of_immobile_row() {
    let mut problem = rays(&[vec![0.0], vec![1.0]], &[1.0, -2.0]).problem();
    problem.guess(0, 3.0);
    problem.solve_by(SWEEPS).unwrap();
    assert_eq!(problem.unknowns()[0], 0.0);
}

#[test]
fn contradictory_stops_are_proved_infeasible() {
    // Position above 1 and below −1.
    let case = rays(&[vec![1.0], vec![-1.0]], &[-1.0, -1.0]);
    for method in METHODS {
        let result = case.problem().solve_by(method);
        if method == Method::Direct {
            assert!(
                matches!(result, Err(SolveError::Infeasible { .. })),
                "{result:?}"
            );
        } else {
            assert!(
                matches!(result, Err(SolveError::Violated { .. })),
                "{method:?} {result:?}"
            );
        }
    }
    // Equalities.
    let mut case = Case::new(
        &[vec![1.0, 1.0], vec![2.0, 2.0]],
        vec![1.0, 1.0],
        vec![Bound::Free; 2],
        0.0,
    );
    assert!(matches!(
        case.problem().solve_by(Method::Direct),
        Err(SolveError::Infeasible { .. })
    ));
    case.b = vec![1.0, 2.0];
    let mut problem = case.problem();
    problem.solve_by(Method::Direct).unwrap();
    assert!(case.satisfies_conditions(problem.unknowns()));
}

#[test]
fn indefinite_matrix_is_not_reported_infeasible() {
    // Forces (1, 1) are a solution; the path ends on a ray, which proves nothing for this matrix.
    let case = Case {
        g: vec![vec![-1.0, 2.0], vec![2.0, -1.0]],
        b: vec![-1.0; 2],
        bounds: vec![Bound::NonNegative; 2],
    };
    assert!(case.satisfies_conditions(&[1.0, 1.0]));
    match case.problem().solve_by(Method::Direct) {
        Ok(_) | Err(SolveError::Undecided { .. } | SolveError::Violated { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn empty_problem_and_zero_offset_are_solved() {
    for method in METHODS {
        let mut problem = Problem::default();
        problem.reset(0);
        assert_eq!(problem.solve_by(method).unwrap().residual, 0.0);
        let case = rays(&[vec![1.0], vec![1.0]], &[0.0, 0.0]);
        let mut problem = case.problem();
        assert_eq!(problem.solve_by(method).unwrap().residual, 0.0);
        assert_eq!(problem.unknowns(), &[0.0, 0.0]);
    }
}

#[test]
fn interval_excluding_zero_is_satisfied_at_zero_offset() {
    for method in METHODS {
        for entry in [2.0, 0.0] {
            let bound = Bound::Between {
                low: 0.5,
                high: 2.0,
            };
            let mut problem = Case::new(&[vec![entry]], vec![0.0], vec![bound], 0.0).problem();
            problem.solve_by(method).unwrap();
            assert_eq!(problem.unknowns(), &[0.5], "{method:?}");
        }
    }
}

#[test]
fn normal_force_at_its_bound_permits_friction() {
    // The normal force is at least 2; the ground alone would require 1.
    for method in METHODS {
        let mut problem = Problem::default();
        problem.reset(3);
        for (i, row) in [[1.0, 0.2, 0.1], [0.2, 1.0, 0.3], [0.1, 0.3, 1.0]]
            .iter()
            .enumerate()
        {
            for (j, &entry) in row.iter().enumerate() {
                problem.set(i, j, entry);
            }
            problem.offset(i, [-1.0, 3.0, 2.0][i]);
        }
        let high = f64::INFINITY;
        problem.bound(0, Bound::Between { low: 2.0, high });
        let (normal, friction) = (0, 0.5);
        problem.bound(1, Bound::Disc { normal, friction });
        let solution = problem.solve_by(method).unwrap();
        let z = problem.unknowns();
        assert_eq!(z[0], 2.0);
        assert!(
            (libm::hypot(z[1], z[2]) - 1.0).abs() < 1e-8,
            "{method:?} {z:?}"
        );
        // Newton's method converges without sweeps.
        assert!(method != Method::Newton || solution.sweeps == 0);
    }
}

#[test]
fn non_finite_input_is_an_error() {
    for method in METHODS {
        for (entry, offset) in [(f64::NAN, -1.0), (1.0, f64::NAN), (1.0, f64::NEG_INFINITY)] {
            let mut problem = Problem::default();
            problem.reset(2);
            problem.set(0, 0, entry);
            problem.set(1, 1, 1.0);
            problem.bound(0, Bound::NonNegative);
            problem.offset(0, offset);
            assert!(
                problem.solve_by(method).is_err(),
                "{method:?} {entry} {offset}"
            );
        }
    }
}

#[test]
fn solutions_are_scale_invariant() {
    for size in [1e-9, 1e9] {
        let mut case = rays(
            &[vec![1.0, 0.5], vec![0.25, 1.0], vec![1.0, 1.0]],
            &[-1.0, 0.5, -0.25],
        );
        case.b.iter_mut().for_each(|b| *b *= size);
        for (i, row) in case.g.iter_mut().enumerate() {
            row[i] += 0.1;
            for g in row {
                *g /= size;
            }
        }
        let mut answers = METHODS.map(|method| {
            let mut problem = case.problem();
            problem.solve_by(method).unwrap();
            problem.unknowns().to_vec()
        });
        let first = answers[0].clone();
        for answer in &mut answers {
            for (a, b) in answer.iter().zip(&first) {
                assert!((a - b).abs() <= 1e-8 * first[0].abs());
            }
        }
    }
}

#[test]
fn relaxation_outside_its_range_is_an_error() {
    for relaxation in [0.0, 2.0, -1.0, f64::NAN] {
        let mut problem = rays(&[vec![1.0]], &[-1.0]).problem();
        let method = Method::GaussSeidel {
            relaxation,
            sweeps: 10,
            tolerance: 1e-9,
        };
        assert!(matches!(
            problem.solve_by(method),
            Err(SolveError::Parameter {
                what: "relaxation",
                ..
            })
        ));
    }
}

#[test]
fn sweep_limit_keeps_last_approximation() {
    let case = Case::new(
        &[vec![1.0, 0.0], vec![0.9, 0.4]],
        vec![-1.0, -1.0],
        vec![Bound::NonNegative; 2],
        0.0,
    );
    let mut problem = case.problem();
    let method = Method::GaussSeidel {
        relaxation: 1.0,
        sweeps: 3,
        tolerance: 1e-12,
    };
    let Err(SolveError::Violated {
        sweeps, residual, ..
    }) = problem.solve_by(method)
    else {
        panic!("not in three sweeps");
    };
    assert_eq!((sweeps, residual), (3, problem.residual()));
    assert!(problem.unknowns()[0] > 0.1);
}

#[test]
fn over_relaxation_saves_sweeps_for_nearly_parallel_rows() {
    let case = Case::new(
        &[vec![1.0, 0.0], vec![0.95, 0.3]],
        vec![-1.0, -1.0],
        vec![Bound::NonNegative; 2],
        0.0,
    );
    let sweeps = [1.0, 1.5].map(|relaxation| {
        let method = Method::GaussSeidel {
            relaxation,
            sweeps: 1000,
            tolerance: 1e-10,
        };
        case.problem().solve_by(method).unwrap().sweeps
    });
    assert!(2 * sweeps[1] < sweeps[0], "{sweeps:?}");
}
