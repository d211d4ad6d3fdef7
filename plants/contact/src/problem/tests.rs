//! Solutions satisfy their complementarity conditions.

use super::*;
use proptest::prelude::*;

/// `G = J Jᵀ + 0.01 I` of random rows: symmetric, positive definite, coupled.
fn problem(n: usize, rows: &[f64], offset: &[f64]) -> Problem {
    let mut problem = Problem::default();
    problem.reset(n);
    for i in 0..n {
        for j in 0..n {
            let product: f64 = (0..6).map(|k| rows[i * 6 + k] * rows[j * 6 + k]).sum();
            problem.set(i, j, product);
        }
        problem.offset(i, offset[i]);
    }
    problem.soften(0.01);
    problem
}

proptest! {
    #[test]
    fn rays_and_intervals_satisfy_their_conditions(
        n in 1..10_usize,
        rows in proptest::collection::vec(-1.0..1.0_f64, 60),
        offset in proptest::collection::vec(-1.0..1.0_f64, 10),
    ) {
        let mut problem = problem(n, &rows, &offset);
        for i in 0..n {
            problem.bound(i, if i % 3 == 2 { Bound::Between { low: -0.5, high: 0.3 } } else { Bound::NonNegative });
        }
        problem.solve().unwrap();
        for i in 0..n {
            let (z, w) = (problem.unknowns()[i], problem.w(i));
            if i % 3 == 2 {
                prop_assert!((-0.5..=0.3).contains(&z));
                prop_assert!(w.abs() < 1e-8 || (z == -0.5 && w > 0.0) || (z == 0.3 && w < 0.0));
            } else {
                prop_assert!(z >= -1e-9 && w >= -1e-8 && (z * w).abs() < 1e-8, "{z} {w}");
            }
        }
    }

    #[test]
    fn friction_lies_in_disc_and_opposes_slip(
        contacts in 1..4_usize,
        friction in 0.0..1.5_f64,
        rows in proptest::collection::vec(-1.0..1.0_f64, 60),
        offset in proptest::collection::vec(-1.0..1.0_f64, 10),
    ) {
        let n = 3 * contacts;
        let mut problem = problem(n, &rows, &offset);
        for c in 0..contacts {
            problem.bound(3 * c, Bound::NonNegative);
            problem.bound(3 * c + 1, Bound::Disc { normal: 3 * c, friction });
        }
        // With friction the problem may have no solution under Coulomb's law for rigid bodies; then
        // the solver must report an error.
        if problem.solve().is_ok() {
            for c in 0..contacts {
                let z = &problem.unknowns()[3 * c..3 * c + 3];
                let w = [problem.w(3 * c + 1), problem.w(3 * c + 2)];
                prop_assert!(z[0] >= -1e-6 && problem.w(3 * c) >= -1e-5);
                let (pull, slip) = (norm([z[1], z[2]]), norm(w));
                prop_assert!(pull <= friction * z[0] + 1e-6);
                if slip > 1e-4 {
                    prop_assert!((pull - friction * z[0]).abs() < 1e-5, "slips below the limit");
                    prop_assert!(z[1] * w[0] + z[2] * w[1] <= -0.99 * pull * slip + 1e-5, "does not oppose slip");
                }
            }
        }
    }
}

#[test]
fn block_on_slope_sticks_below_friction_angle_and_slides_above() {
    // Unit mass, frame of the slope: gravity (−g sin a) along, (−g cos a) across.
    for (slope, slides) in [(0.3_f64, false), (0.7, true)] {
        let mut problem = Problem::default();
        problem.reset(3);
        for i in 0..3 {
            problem.set(i, i, 1.0);
        }
        problem.bound(0, Bound::NonNegative);
        problem.bound(
            1,
            Bound::Disc {
                normal: 0,
                friction: 0.5,
            },
        );
        problem.offset(0, -9.81 * libm::cos(slope));
        problem.offset(1, -9.81 * libm::sin(slope));
        problem.solve().unwrap();
        let acceleration = problem.w(1);
        let expected = if slides {
            -9.81 * (libm::sin(slope) - 0.5 * libm::cos(slope))
        } else {
            0.0
        };
        assert!(
            (acceleration - expected).abs() < 1e-12,
            "{acceleration} {expected}"
        );
    }
}

#[test]
fn redundant_supports_share_load_equally() {
    // Four supports of one rigid plate: four unknowns, rank three.
    let mut problem = Problem::default();
    problem.reset(4);
    let corner = [
        [1.0, 1.0, 1.0],
        [1.0, 1.0, -1.0],
        [1.0, -1.0, 1.0],
        [1.0, -1.0, -1.0],
    ];
    for i in 0..4 {
        for j in 0..4 {
            problem.set(
                i,
                j,
                (0..3).map(|k: usize| corner[i][k] * corner[j][k]).sum(),
            );
        }
        problem.bound(i, Bound::NonNegative);
        problem.offset(i, -9.81);
    }
    problem.soften(1e-9);
    problem.solve().unwrap();
    for z in problem.unknowns() {
        assert!((z - 9.81 / 4.0).abs() < 1e-6, "{z}");
    }
}
