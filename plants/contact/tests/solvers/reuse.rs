//! One problem after another in the same memory: rows that are free, bounded, held at zero and let go again, friction pairs
//! among them, and guesses that belong to another problem. Each answer is judged by the conditions as they are written.

use proptest::prelude::*;
use twinrig_contact::{Bound, Problem};

use crate::oracle::Case;

/// Held at zero, as a constraint that parts is.
const NOTHING: Bound = Bound::Between {
    low: 0.0,
    high: 0.0,
};

/// What a few rows stand for.
#[derive(Debug, Clone, Copy)]
enum Block {
    One(Bound),
    /// A normal and its friction pair.
    Foot {
        friction: f64,
    },
}

/// How a problem goes on from the one before it.
#[derive(Debug, Clone)]
enum Change {
    /// Another problem, with the old unknowns for a guess or with these.
    Another { case: Case, guess: Vec<f64> },
    /// The same G and bounds at other offsets.
    Offsets(Vec<f64>),
    /// The normals and stops of these rows held at zero, or free to push again.
    Parts(Vec<bool>),
}

fn block() -> impl Strategy<Value = Block> {
    prop_oneof![
        1 => Just(Block::One(Bound::Free)),
        2 => Just(Block::One(Bound::NonNegative)),
        1 => Just(Block::One(NOTHING)),
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
            .prop_map(|(case, guess)| Change::Another { case, guess }),
        1 => numbers().prop_map(Change::Offsets),
        2 => proptest::collection::vec(any::<bool>(), 20).prop_map(Change::Parts),
    ]
}

/// Rebinds normals and stops: what a plant does whose constraints part.
fn rebind(case: &mut Case, problem: &mut Problem, parts: &[bool]) {
    for (row, &parts) in (0..case.len()).zip(parts) {
        let bound = match case.bounds[row] {
            Bound::NonNegative | NOTHING if parts => NOTHING,
            Bound::NonNegative | NOTHING => Bound::NonNegative,
            _ => continue,
        };
        case.bounds[row] = bound;
        problem.bound(row, bound);
    }
}

/// The conditions, as they are written.
fn holds(case: &Case, z: &[f64]) -> Result<(), String> {
    const NEAR: f64 = 1e-6;
    let w = case.w(z);
    for (row, bound) in case.bounds.iter().enumerate() {
        let (z_own, w_own) = (z[row], w[row]);
        let met = match *bound {
            Bound::Free => w_own.abs() < NEAR,
            Bound::NonNegative => z_own > -NEAR && w_own > -NEAR && (z_own < NEAR || w_own < NEAR),
            Bound::Between { low, high } => {
                z_own > low - NEAR
                    && z_own < high + NEAR
                    && (w_own < NEAR || z_own < low + NEAR)
                    && (w_own > -NEAR || z_own > high - NEAR)
            }
            Bound::Disc { normal, friction } => {
                let (pull, slip) = (
                    libm::hypot(z_own, z[row + 1]),
                    libm::hypot(w_own, w[row + 1]),
                );
                let (limit, work) = (
                    friction * z[normal],
                    z_own * w_own + z[row + 1] * w[row + 1],
                );
                pull < limit + NEAR && (slip < NEAR || (work + limit * slip).abs() < NEAR)
            }
            Bound::DiscSecond => true,
        };
        if !met {
            return Err(format!("row {row}, {bound:?}: z {z_own} w {w_own}"));
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_answer_meets_its_conditions(first in case(), changes in proptest::collection::vec(change(), 1..8)) {
        let mut case = first;
        let mut problem = case.problem();
        problem.solve().unwrap();
        for change in changes {
            match change {
                Change::Another { case: other, guess } => {
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
                Change::Parts(parts) => rebind(&mut case, &mut problem, &parts),
            }
            let solved = problem.solve();
            prop_assert!(solved.is_ok(), "{:?}", solved);
            let judged = holds(&case, problem.unknowns());
            prop_assert!(judged.is_ok(), "{:?}", judged);
        }
    }
}

/// A foot, a stop, and a second foot.
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
fn a_friction_pair_that_is_none_is_refused() {
    let disc = |normal| Bound::Disc {
        normal,
        friction: 0.5,
    };
    let wrong = [
        // Half of a pair bounded by itself: the other half would go on alone.
        (1, NOTHING, "half of a friction pair"),
        (2, NOTHING, "half of a friction pair"),
        (6, Bound::Free, "half of a friction pair"),
        (3, Bound::DiscSecond, "bounded by the friction pair"),
        // Pairs that overlap others, or end beyond the last row.
        (2, disc(0), "overlaps"),
        (0, disc(3), "overlaps"),
        (6, disc(0), "friction pair at rows 6 and 7 of 7"),
        // Normals that are not there, or friction themselves, or the pair's own rows.
        (1, disc(7), "no normal force"),
        (1, disc(1), "no normal force"),
        (1, disc(5), "no normal force"),
        // The second row would be the normal of the second foot.
        (3, disc(0), "overlaps"),
    ];
    for (row, bound, why) in wrong {
        let mut problem = two_feet_and_a_stop();
        let refused = std::panic::catch_unwind(move || problem.bound(row, bound));
        let said = refused.unwrap_err();
        let said = said.downcast_ref::<String>().unwrap();
        assert!(said.contains(why), "{row} {bound:?}: {said}");
    }
}

#[test]
fn a_friction_coefficient_is_no_negative_number_and_may_be_changed() {
    let mut problem = two_feet_and_a_stop();
    let (normal, friction) = (0, 1.5);
    problem.bound(1, Bound::Disc { normal, friction });
    for friction in [-0.1, f64::NAN] {
        let mut problem = problem.clone();
        let refused = std::panic::catch_unwind(move || {
            problem.bound(1, Bound::Disc { normal, friction });
        });
        assert!(refused.is_err(), "{friction}");
    }
}
