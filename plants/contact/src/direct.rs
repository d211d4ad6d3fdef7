//! The direct solver: the problem in the standard form of Lemke's method, and what its end says about the problem.
//!
//! Each z is a base and non-negative x along directions: a ray is one x; an interval one from its end, with a second for
//! the room that is left, 0 ≤ u ⊥ high − low − x ≥ 0; a line one free x. A disc becomes the pyramid of Stewart and
//! Trinkle (1996), eight sides β along dₖ and a slip speed λ:
//!
//! ```text
//!  0 ≤ βₖ ⊥ dₖ·w + λ ≥ 0        0 ≤ λ ⊥ µ zₙ − Σ βₖ ≥ 0
//! ```
//!
//! which decides between sticking and slipping, and says into which eighth; Newton's method starts from there and gives
//! the disc itself.

use crate::lemke::{End, Lemke};
use crate::problem::{ACCEPTABLE, Bound, Problem, TOLERANCE};
use crate::solution::{Solution, Unsolved};

/// Sides of a pyramid, as cosine and sine.
const SIDES: [[f64; 2]; 8] = {
    const D: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        [1.0, 0.0],
        [D, D],
        [0.0, 1.0],
        [-D, D],
        [-1.0, 0.0],
        [-D, -D],
        [0.0, -1.0],
        [D, -D],
    ]
};

/// One x of the standard form.
#[derive(Debug, Clone, Copy)]
enum Part {
    /// A force along weights of an unknown and, where the second is not zero, of the next.
    Force { row: usize, weights: [f64; 2] },
    /// What holds the force of that column at its far end.
    Room { of: usize, width: f64 },
    /// The slip speed of the pyramid whose sides end here, under that normal force.
    Slip { normal: usize, share: f64 },
}

/// The standard form, with the memory of its solver.
#[derive(Debug, Clone, Default)]
pub(crate) struct Direct {
    lemke: Lemke,
    parts: Vec<Part>,
    /// Columns of the unknowns: a normal force is looked up there.
    columns: Vec<usize>,
    base: Vec<f64>,
    /// Inverse roots of the mobilities: in their units G has a diagonal of ones.
    units: Vec<f64>,
    /// Greatest offset in those units, and so of the order of the x.
    size: f64,
    x: Vec<f64>,
    diagonal: Vec<f64>,
    offset: Vec<f64>,
    unknowns: Vec<f64>,
}

impl Problem {
    /// Pivots to a solution, or to the proof that there is none.
    pub(crate) fn solve_directly(&mut self) -> Result<Solution, Unsolved> {
        let mut direct = self.direct.take().unwrap_or_default();
        let result = direct.solve(self);
        self.direct = Some(direct);
        result
    }
}

impl Direct {
    fn solve(&mut self, problem: &mut Problem) -> Result<Solution, Unsolved> {
        problem.factored = false;
        let scale = problem.scale();
        if !scale.is_finite() {
            return Err(problem.unsolvable());
        }
        self.divide(problem);
        self.fill(problem);
        let end = self.lemke.solve();
        let (size, pivots) = (problem.len(), self.lemke.pivots);
        if end == End::Ray {
            problem.unknowns.fill(0.0);
            add(
                &self.parts,
                self.lemke.ray(),
                1.0,
                &mut problem.unknowns[..size],
            );
            if self.proves(problem) {
                return Err(Unsolved::Infeasible { size, pivots });
            }
        }
        self.x.resize(self.parts.len(), 0.0);
        self.lemke.solution(&mut self.x);
        problem.unknowns.fill(0.0);
        problem.unknowns[..size].copy_from_slice(&self.base);
        add(&self.parts, &self.x, self.size, &mut problem.unknowns);
        let mut solution = Solution {
            pivots,
            residual: problem.residual(),
            ..Solution::default()
        };
        if solution.residual <= TOLERANCE * scale {
            return Ok(solution);
        }
        self.refine(problem, &mut solution, scale);
        if solution.residual <= ACCEPTABLE * scale {
            return Ok(solution);
        }
        Err(if end == End::Solution {
            Unsolved::Violated {
                size,
                sweeps: solution.sweeps,
                residual: solution.residual,
            }
        } else {
            Unsolved::Undecided { size, pivots }
        })
    }

    /// Divides the unknowns into parts.
    fn divide(&mut self, problem: &Problem) {
        let largest = problem.greatest_mobility();
        self.units.clear();
        self.base.clear();
        self.parts.clear();
        self.columns.clear();
        for (row, &bound) in problem.bounds.iter().enumerate() {
            let mobility = match bound {
                Bound::Disc { .. } => problem.entry(row, row).max(problem.entry(row + 1, row + 1)),
                Bound::DiscSecond => 1.0 / (self.units[row - 1] * self.units[row - 1]),
                _ => problem.entry(row, row),
            };
            let unit = 1.0 / libm::sqrt(if mobility > 0.0 { mobility } else { largest });
            self.units.push(unit);
            self.columns.push(self.parts.len());
            let (base, weight, width) = match bound {
                Bound::Between { low, high } if low.is_finite() => (low, unit, Some(high - low)),
                Bound::Between { high, .. } if high.is_finite() => (high, -unit, None),
                Bound::Free | Bound::NonNegative | Bound::Between { .. } => (0.0, unit, None),
                Bound::Disc { .. } | Bound::DiscSecond => {
                    self.base.push(0.0);
                    continue;
                }
            };
            self.base.push(base);
            let of = self.parts.len();
            self.parts.push(Part::Force {
                row,
                weights: [weight, 0.0],
            });
            if let Some(width) = width.filter(|width| width.is_finite()) {
                self.parts.push(Part::Room {
                    of,
                    width: width / unit,
                });
            }
        }
        for (row, &bound) in problem.bounds.iter().enumerate() {
            if let Bound::Disc { normal, friction } = bound {
                let unit = self.units[row];
                self.parts.extend(SIDES.map(|side| Part::Force {
                    row,
                    weights: side.map(|component| unit * component),
                }));
                self.parts.push(Part::Slip {
                    normal,
                    share: friction / unit,
                });
            }
        }
    }

    /// Fills the tableau.
    fn fill(&mut self, problem: &Problem) {
        let Self { lemke, parts, .. } = self;
        lemke.reset(parts.len());
        self.size = 0.0;
        for (i, part) in parts.iter().enumerate() {
            match *part {
                Part::Force { row, weights } => {
                    if is_free(problem.bounds[row]) {
                        lemke.free(i);
                    }
                    let mut offset = 0.0;
                    for (k, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                        let held = self.base.iter().enumerate();
                        let held = held.map(|(j, base)| problem.entry(row + k, j) * base);
                        offset += weight * (problem.offset[row + k] + held.sum::<f64>());
                    }
                    self.size = self.size.max(offset.abs());
                    lemke.offset(i, offset);
                    for (j, other) in parts.iter().enumerate() {
                        if let Part::Force {
                            row: column,
                            weights: across,
                        } = *other
                        {
                            lemke.set(i, j, between(problem, row, weights, column, across));
                        }
                    }
                }
                Part::Room { of, width } => {
                    lemke.offset(i, width);
                    lemke.set(i, of, -1.0);
                    lemke.set(of, i, 1.0);
                }
                Part::Slip { normal, share } => {
                    lemke.offset(i, share * self.base[normal]);
                    let column = self.columns[normal];
                    if let Part::Force { weights, .. } = parts[column] {
                        lemke.set(i, column, share * weights[0]);
                    }
                    for side in i - SIDES.len()..i {
                        lemke.set(i, side, -1.0);
                        lemke.set(side, i, 1.0);
                    }
                }
            }
        }
        if self.size == 0.0 {
            self.size = 1.0;
        }
        lemke.divide_offsets(self.size);
    }

    /// Whether the unknowns are forces **v** that prove that there is no solution: allowed in any multiple, without effect,
    /// and worked upon by the offset. Then every **w** would have **w**·**v** = **b**·**v** < 0, while bounds ask for ≥ 0.
    fn proves(&self, problem: &mut Problem) -> bool {
        const NEGLIGIBLE: f64 = 1e-9;
        let n = problem.len();
        let greatest = (0..n).fold(0.0_f64, |most, i| {
            most.max(problem.unknowns[i].abs() / self.units[i])
        });
        if !(greatest > 0.0 && greatest.is_finite()) {
            return false;
        }
        let mut work = 0.0;
        for i in 0..n {
            problem.unknowns[i] /= greatest;
            work += problem.unknowns[i] * problem.offset[i];
        }
        if work > 0.0 {
            problem.unknowns.iter_mut().for_each(|v| *v = -*v);
            work = -work;
        }
        work < -NEGLIGIBLE * self.size
            && (0..n).all(|i| {
                let (v, unit) = (problem.unknowns[i], self.units[i]);
                let moved: f64 = (0..n)
                    .map(|j| problem.entry(i, j) * problem.unknowns[j])
                    .sum();
                let (up, down) = match problem.bounds[i] {
                    Bound::Free => (true, true),
                    Bound::NonNegative => (true, false),
                    Bound::Between { low, high } => (high.is_infinite(), low.is_infinite()),
                    Bound::Disc { .. } | Bound::DiscSecond => (false, false),
                };
                (unit * moved).abs() <= NEGLIGIBLE
                    && (up || v <= NEGLIGIBLE * unit)
                    && (down || v >= -NEGLIGIBLE * unit)
            })
    }

    /// Newton's method from where pivoting ended; then, should G be singular, towards the solution of least change, by
    /// steps that each resist change a little (a proximal iteration).
    fn refine(&mut self, problem: &mut Problem, solution: &mut Solution, scale: f64) {
        const STEPS: usize = 30;
        const RESISTANCE: f64 = 1e-6;
        let (n, tolerance) = (problem.len(), TOLERANCE * scale);
        self.unknowns.clone_from(&problem.unknowns);
        problem.measure();
        problem.judge();
        let residual = problem.newton(&mut solution.factorisations, tolerance);
        self.keep_better(problem, solution, residual);
        self.offset.clone_from(&problem.offset);
        self.diagonal.clear();
        self.diagonal.extend((0..n).map(|i| problem.entry(i, i)));
        for _ in 0..STEPS {
            if solution.residual <= tolerance {
                break;
            }
            for i in 0..n {
                let resistance = RESISTANCE / (self.units[i] * self.units[i]);
                problem.set(i, i, self.diagonal[i] + resistance);
                problem.offset[i] = self.offset[i] - resistance * problem.unknowns[i];
            }
            let step = problem.solve_within(TOLERANCE, 0.0).unwrap_or_default();
            for i in 0..n {
                problem.set(i, i, self.diagonal[i]);
            }
            problem.offset.copy_from_slice(&self.offset);
            solution.factorisations += step.factorisations;
            solution.sweeps += step.sweeps;
            let before = solution.residual;
            let residual = problem.residual();
            self.keep_better(problem, solution, residual);
            if solution.residual > 0.5 * before {
                break;
            }
        }
        if solution.residual > ACCEPTABLE * scale {
            // The pyramid may have led astray. Newton's own way from nothing is another.
            problem.unknowns.fill(0.0);
            let way = problem.solve().unwrap_or_default();
            solution.factorisations += way.factorisations;
            solution.sweeps += way.sweeps;
            let residual = problem.residual();
            self.keep_better(problem, solution, residual);
        }
    }

    /// Takes the unknowns if they are better than those kept, otherwise goes back to these.
    fn keep_better(&mut self, problem: &mut Problem, solution: &mut Solution, residual: f64) {
        if residual < solution.residual {
            solution.residual = residual;
            self.unknowns.clone_from(&problem.unknowns);
        } else {
            problem.unknowns.clone_from(&self.unknowns);
        }
    }
}

/// Adds what the parts make of the unknowns.
fn add(parts: &[Part], x: &[f64], factor: f64, unknowns: &mut [f64]) {
    for (part, x) in parts.iter().zip(x) {
        if let Part::Force { row, weights } = *part {
            unknowns[row] += factor * weights[0] * x;
            if weights[1] != 0.0 {
                unknowns[row + 1] += factor * weights[1] * x;
            }
        }
    }
}

/// Mobility between two forces.
fn between(problem: &Problem, row: usize, along: [f64; 2], column: usize, across: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for (i, a) in along.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        for (j, b) in across.iter().enumerate().filter(|(_, b)| **b != 0.0) {
            sum += a * problem.entry(row + i, column + j) * b;
        }
    }
    sum
}

fn is_free(bound: Bound) -> bool {
    match bound {
        Bound::Free => true,
        Bound::Between { low, high } => low.is_infinite() && high.is_infinite(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of unit mass on a slope along x, which is one of the pyramid's directions: pivots alone give the disc's
    /// answer. Its normal force may be bound from below, as in the second phase of an impact.
    #[test]
    fn along_its_sides_the_pyramid_is_the_disc() {
        for (low, friction, pull) in [(0.0, 0.5, 7.0), (0.0, 1.5, 7.0), (12.0, 0.5, 7.0)] {
            let mut problem = Problem::default();
            problem.reset(3);
            for (row, mobility) in [2.0, 0.5, 0.5].into_iter().enumerate() {
                problem.set(row, row, mobility);
            }
            let high = f64::INFINITY;
            problem.bound(0, Bound::Between { low, high });
            let normal = 0;
            problem.bound(1, Bound::Disc { normal, friction });
            problem.offset(0, -20.0);
            problem.offset(1, pull);
            let solution = problem.solve_by(crate::Method::Direct).unwrap();
            assert_eq!(solution.factorisations, 0);
            let force = f64::max(low, 10.0);
            let held = f64::min(friction * force, pull / 0.5);
            let expected = [force, -held, 0.0];
            for (z, expected) in problem.unknowns().iter().zip(expected) {
                assert!((z - expected).abs() < 1e-12, "{:?}", problem.unknowns());
            }
        }
    }
}
