//! Sequences of problems in the same memory: rows that are free, bounded, bounded to zero and
//! released again, friction pairs among them, and guesses from other problems. Each solution is
//! checked against the definitions of the conditions.

use proptest::prelude::*;
use twinrig_contact::{Bound, Problem};

use crate::oracle::Case;

/// Zero force, as of a constraint that separates.
const ZERO: Bound = Bound::Between {
    low: 0.0,
    high: 0.0,
};

/// One row, or the three rows of a foot.
#[derive(Debug, Clone, Copy)]
enum Block {
    One(Bound),
    /// Normal force and its friction pair.
    Foot {
        friction: f64,
    },
}

/// Transition from one problem to the next.
#[derive(Debug, Clone)]
enum Change {
    /// Another problem, with the previous unknowns or these as the guess.
    Replace { case: Case, guess: Vec<f64> },
    /// The same G and bounds with other offsets.
    Offsets(Vec<f64>),
    /// Normals and stops of these rows bounded to zero, or released.
    Separate(Vec<bool>),
}

fn block() -> impl Strategy<Value = Block> {
    prop_oneof![
        1 => Just(Block::One(Bound::Free)),
        2 => Just(Block::One(Bound::NonNegative)),
        1 => Just(Block::One(ZERO)),
        1 => (-1.0..0.5_f64, 0.0..1.0_f64).prop_map(|(low, width)| {
            Block::One(Bound::Between { low, high: low + width })
        }),
        3 => (0.0..0.6_f64).prop_map(|friction| Block::Foot { friction }),
    ]
}

fn case() -> impl Strategy<Value = Case> {
    proptest::collection::vec(block(), 1..6)
        .prop_flat_map(|blocks| {
            let mut bounds = Vec::new();
            for block in blocks {
                match block {
                    Block::One(bound) => bounds.push(bound),
                    Block::Foot { friction } => {
                        let normal = bounds.len();
                        let pair = Bound::Disc { normal, friction };
                        bounds.extend([Bound::NonNegative, pair, Bound::DiscSecond]);
                    }
                }
            }
            let n = bounds.len();
            let any = |n| proptest::collection::vec(-1.0..1.0_f64, n);
            (proptest::collection::vec(any(8), n), any(n), Just(bounds))
        })
        .prop_map(|(j, b, bounds)| Case::new(&j, b, bounds, 0.5))
}

fn change() -> impl Strategy<Value = Change> {
    let numbers = || proptest::collection::vec(-1.0..1.0_f64, 20);
    prop_oneof![
        2 => (case(), prop_oneof![Just(Vec::new()), numbers()])
            .prop_map(|(case, guess)| Change::Replace { case, guess }),
        1 => numbers().prop_map(Change::Offsets),
        2 => proptest::collection::vec(any::<bool>(), 20).prop_map(Change::Separate),
    ]
}

/// Rebinds normals and stops, as a plant does when constraints separate.
fn rebind(case: &mut Case, problem: &mut Problem, separates: &[bool]) {
    for (row, &separates) in (0..case.len()).zip(separates) {
        let bound = match case.bounds[row] {
            Bound::NonNegative | ZERO if separates => ZERO,
            Bound::NonNegative | ZERO => Bound::NonNegative,
            _ => continue,
        };
        case.bounds[row] = bound;
        problem.bound(row, bound);
    }
}

/// Checks the conditions by their definitions.
fn check_conditions(case: &Case, z: &[f64]) -> Result<(), String> {
    const NEAR: f64 = 1e-6;
    let w = case.w(z);
    for (row, bound) in case.bounds.iter().enumerate() {
        let (z_row, w_row) = (z[row], w[row]);
        let satisfied = match *bound {
            Bound::Free => w_row.abs() < NEAR,
            Bound::NonNegative => z_row > -NEAR && w_row > -NEAR && (z_row < NEAR || w_row < NEAR),
            Bound::Between { low, high } => {
                z_row > low - NEAR
                    && z_row < high + NEAR
                    && (w_row < NEAR || z_row < low + NEAR)
                    && (w_row > -NEAR || z_row > high - NEAR)
            }
            Bound::Disc { normal, friction } => {
                let (pull, slip) = (
                    libm::hypot(z_row, z[row + 1]),
                    libm::hypot(w_row, w[row + 1]),
                );
                let (limit, work) = (
                    friction * z[normal],
                    z_row * w_row + z[row + 1] * w[row + 1],
                );
                pull < limit + NEAR && (slip < NEAR || (work + limit * slip).abs() < NEAR)
            }
            Bound::DiscSecond => true,
        };
        if !satisfied {
            return Err(format!("row {row}, {bound:?}: z {z_row} w {w_row}"));
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_solution_satisfies_its_conditions(first in case(), changes in proptest::collection::vec(change(), 1..8)) {
        let mut case = first;
        let mut problem = case.problem();
        problem.solve().unwrap();
        for change in changes {
            match change {
                Change::Replace { case: other, guess } => {
                    let before = problem.unknowns().to_vec();
                    case = other;
                    case.fill(&mut problem);
                    let guess = if guess.is_empty() { before } else { guess };
                    for (row, value) in (0..case.len()).zip(guess) {
                        problem.guess(row, value);
                    }
                }
                Change::Offsets(offsets) => {
                    for (row, value) in (0..case.len()).zip(offsets) {
                        case.b[row] = value;
                        problem.offset(row, value);
                    }
                }
                Change::Separate(separates) => rebind(&mut case, &mut problem, &separates),
            }
            let solved = problem.solve();
            prop_assert!(solved.is_ok(), "{:?}", solved);
            let checked = check_conditions(&case, problem.unknowns());
            prop_assert!(checked.is_ok(), "{:?}", checked);
        }
    }
}

/// Returns a problem of a foot, a stop, and a second foot.
fn two_feet_and_a_stop() -> Problem {
    let mut problem = Problem::default();
    problem.reset(7);
    for (normal, friction) in [(0, 0.6), (4, 0.3)] {
        problem.bound(normal, Bound::NonNegative);
        problem.bound(normal + 1, Bound::Disc { normal, friction });
    }
    problem.bound(3, Bound::NonNegative);
    problem
}

#[test]
fn invalid_friction_pair_panics() {
    let disc = |normal| Bound::Disc {
        normal,
        friction: 0.5,
    };
    let wrong = [
        // Half of a pair bounded separately.
        (1, ZERO, "half of a friction pair"),
        (2, ZERO, "half of a friction pair"),
        (6, Bound::Free, "half of a friction pair"),
        (3, Bound::DiscSecond, "bounded by the friction pair"),
        // Pairs that overlap others or end beyond the last row.
        (2, disc(0), "overlaps"),
        (0, disc(3), "overlaps"),
        (6, disc(0), "friction pair at rows 6 and 7 of 7"),
        // Normals out of range, within a friction pair, or within the pair itself.
        (1, disc(7), "cannot be the normal force"),
        (1, disc(1), "cannot be the normal force"),
        (1, disc(5), "cannot be the normal force"),
        // The second row would be the normal of the second foot.
        (3, disc(0), "overlaps"),
    ];
    for (row, bound, expected) in wrong {
        let mut problem = two_feet_and_a_stop();
        let result = std::panic::catch_unwind(move || problem.bound(row, bound));
        let message = result.unwrap_err();
        let message = message.downcast_ref::<String>().unwrap();
        assert!(message.contains(expected), "{row} {bound:?}: {message}");
    }
}

#[test]
fn friction_coefficient_is_mutable_and_must_be_non_negative() {
    let mut problem = two_feet_and_a_stop();
    let (normal, friction) = (0, 1.5);
    problem.bound(1, Bound::Disc { normal, friction });
    for friction in [-0.1, f64::NAN] {
        let mut problem = problem.clone();
        let result = std::panic::catch_unwind(move || {
            problem.bound(1, Bound::Disc { normal, friction });
        });
        assert!(result.is_err(), "{friction}");
    }
}
