//! Cost of a solve from a zero guess: coupled stops, and feet on the ground.

use divan::Bencher;
use twinrig_contact::{Bound, Method, Problem};

fn main() {
    divan::main();
}

const METHODS: [(&str, Method); 3] = [
    ("newton", Method::Newton),
    ("direct", Method::Direct),
    (
        "sweeps",
        Method::GaussSeidel {
            relaxation: 1.2,
            sweeps: 10_000,
            tolerance: 1e-9,
        },
    ),
];

const NAMES: [&str; 3] = ["newton", "direct", "sweeps"];

/// Deterministic pseudorandom numbers in [−1, 1).
struct Lcg(u64);

impl Lcg {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Returns `G = J Jᵀ` of `n` rows on `freedoms`, with the compliance of 1e-9 that the plants use.
fn problem(n: usize, freedoms: usize, numbers: &mut Lcg) -> (Problem, Vec<Vec<f64>>) {
    let j: Vec<Vec<f64>> = (0..n)
        .map(|_| (0..freedoms).map(|_| numbers.next()).collect())
        .collect();
    let mut problem = Problem::default();
    problem.reset(n);
    for (row, a) in j.iter().enumerate() {
        for (column, b) in j.iter().enumerate() {
            problem.set(row, column, a.iter().zip(b).map(|(a, b)| a * b).sum());
        }
    }
    problem.soften(1e-9);
    (problem, j)
}

/// Returns sixteen problems, to prevent the branch predictor from learning a single one.
fn problems(n: usize, freedoms: usize, contact: bool) -> Vec<Problem> {
    let mut numbers = Lcg(7);
    let problems = (0..16).map(|_| {
        let (mut problem, j) = problem(n, freedoms, &mut numbers);
        // Offsets are rates of a motion, so that a solution exists.
        let motion: Vec<f64> = (0..freedoms).map(|_| numbers.next()).collect();
        for (row, j) in j.iter().enumerate() {
            problem.offset(row, j.iter().zip(&motion).map(|(j, v)| j * v).sum());
            if !contact || row % 3 == 0 {
                problem.bound(row, Bound::NonNegative);
            } else if row % 3 == 1 {
                let normal = row - 1;
                problem.bound(
                    row,
                    Bound::Disc {
                        normal,
                        friction: 0.6,
                    },
                );
            }
        }
        problem
    });
    problems.collect()
}

fn solve(bencher: Bencher, method: &str, mut problems: Vec<Problem>) {
    let method = METHODS[NAMES.iter().position(|&name| name == method).unwrap_or(0)].1;
    let unsolved = problems
        .iter_mut()
        .filter_map(|problem| problem.solve_by(method).err())
        .count();
    if unsolved > 0 {
        eprintln!("{method:?}: {unsolved} of 16 not solved");
    }
    bencher
        .counter(divan::counter::ItemsCount::new(problems.len()))
        .bench_local(|| {
            for problem in &mut problems {
                for row in 0..problem.len() {
                    problem.guess(row, 0.0);
                }
                // Invalidates the factors of the previous solve.
                problem.soften(0.0);
                let _ = divan::black_box(problem.solve_by(method));
            }
        });
}

/// Stops on as many degrees of freedom plus two.
#[divan::bench(args = NAMES, consts = [2, 4, 6, 12])]
fn stops<const N: usize>(bencher: Bencher, method: &str) {
    solve(bencher, method, problems(N, N + 2, false));
}

/// Redundant stops: twice as many as degrees of freedom.
#[divan::bench(args = NAMES, consts = [4, 6, 12])]
fn redundant_stops<const N: usize>(bencher: Bencher, method: &str) {
    solve(bencher, method, problems(N, N / 2, false));
}

/// Feet, three rows each, of a body with degrees of freedom for every foot.
#[divan::bench(args = NAMES, consts = [3, 6, 12])]
fn feet<const N: usize>(bencher: Bencher, method: &str) {
    solve(bencher, method, problems(N, N + 6, true));
}
