//! Direct solver: transformation of the problem to the standard form of Lemke's method, and
//! interpretation of its outcome.
//!
//! Each z is a base value plus non-negative x along directions. A ray is one x; an interval is one
//! x from its finite end, with a second x for the remaining slack, 0 ≤ u ⊥ high − low − x ≥ 0; an
//! unbounded z is one free x. A friction disc becomes the pyramid of Stewart and Trinkle (1996)
//! with eight sides β along dₖ and a slip speed λ:
//!
//! ```text
//!  0 ≤ βₖ ⊥ dₖ·w + λ ≥ 0        0 ≤ λ ⊥ µ zₙ − Σ βₖ ≥ 0
//! ```
//!
//! The pyramid decides between sticking and slipping, and selects the octant of slip; Newton's
//! method then starts from there and solves for the disc itself.

use crate::bound::Bound;
use crate::lemke::End;
use crate::problem::{ACCEPTABLE, Problem, TOLERANCE};
use crate::solution::{Solution, SolveError};
use crate::workspace::{Direct, Variable};

/// Directions of the sides of the pyramid, as cosine and sine.
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

impl Problem {
    /// Pivots to a solution or to a proof of infeasibility.
    pub(crate) fn solve_directly(&mut self) -> Result<Solution, SolveError> {
        let mut direct = self.direct.take().unwrap_or_default();
        let result = direct.solve(self);
        self.direct = Some(direct);
        result
    }
}

impl Direct {
    fn solve(&mut self, problem: &mut Problem) -> Result<Solution, SolveError> {
        problem.factored = false;
        let scale = problem.scale();
        if !scale.is_finite() {
            return Err(problem.unsolvable());
        }
        self.define_variables(problem);
        self.fill(problem);
        let end = self.lemke.solve();
        let (size, pivots) = (problem.len(), self.lemke.pivots);
        if end == End::Ray {
            problem.unknowns.fill(0.0);
            add(
                &self.variables,
                self.lemke.ray(),
                1.0,
                &mut problem.unknowns[..size],
            );
            if self.proves_infeasible(problem) {
                return Err(SolveError::Infeasible { size, pivots });
            }
        }
        self.x.resize(self.variables.len(), 0.0);
        self.lemke.solution(&mut self.x);
        problem.unknowns.fill(0.0);
        problem.unknowns[..size].copy_from_slice(&self.base);
        add(&self.variables, &self.x, self.size, &mut problem.unknowns);
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
            SolveError::Violated {
                size,
                sweeps: solution.sweeps,
                residual: solution.residual,
            }
        } else {
            SolveError::Undecided { size, pivots }
        })
    }

    /// Defines the variables of the standard form.
    fn define_variables(&mut self, problem: &Problem) {
        let largest = problem.greatest_mobility();
        self.units.clear();
        self.base.clear();
        self.variables.clear();
        self.columns.clear();
        for (row, &bound) in problem.bounds.iter().enumerate() {
            let mobility = match bound {
                Bound::Disc { .. } => problem.entry(row, row).max(problem.entry(row + 1, row + 1)),
                Bound::DiscSecond => 1.0 / (self.units[row - 1] * self.units[row - 1]),
                _ => problem.entry(row, row),
            };
            let unit = 1.0 / libm::sqrt(if mobility > 0.0 { mobility } else { largest });
            self.units.push(unit);
            self.columns.push(self.variables.len());
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
            let of = self.variables.len();
            self.variables.push(Variable::Force {
                row,
                weights: [weight, 0.0],
            });
            if let Some(width) = width.filter(|width| width.is_finite()) {
                self.variables.push(Variable::Slack {
                    of,
                    width: width / unit,
                });
            }
        }
        for (row, &bound) in problem.bounds.iter().enumerate() {
            if let Bound::Disc { normal, friction } = bound {
                let unit = self.units[row];
                self.variables.extend(SIDES.map(|side| Variable::Force {
                    row,
                    weights: side.map(|component| unit * component),
                }));
                self.variables.push(Variable::Slip {
                    normal,
                    share: friction / unit,
                });
            }
        }
    }

    /// Fills the tableau.
    fn fill(&mut self, problem: &Problem) {
        let Self {
            lemke, variables, ..
        } = self;
        lemke.reset(variables.len());
        self.size = 0.0;
        for (i, variable) in variables.iter().enumerate() {
            match *variable {
                Variable::Force { row, weights } => {
                    if is_free(problem.bounds[row]) {
                        lemke.free(i);
                    }
                    let mut offset = 0.0;
                    for (k, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                        let base_rates = self.base.iter().enumerate();
                        let base_rates =
                            base_rates.map(|(j, base)| problem.entry(row + k, j) * base);
                        offset += weight * (problem.offset[row + k] + base_rates.sum::<f64>());
                    }
                    self.size = self.size.max(offset.abs());
                    lemke.offset(i, offset);
                    for (j, other) in variables.iter().enumerate() {
                        if let Variable::Force {
                            row: column,
                            weights: across,
                        } = *other
                        {
                            lemke.set(
                                i,
                                j,
                                mobility_between(problem, row, weights, column, across),
                            );
                        }
                    }
                }
                Variable::Slack { of, width } => {
                    lemke.offset(i, width);
                    lemke.set(i, of, -1.0);
                    lemke.set(of, i, 1.0);
                }
                Variable::Slip { normal, share } => {
                    lemke.offset(i, share * self.base[normal]);
                    let column = self.columns[normal];
                    if let Variable::Force { weights, .. } = variables[column] {
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

    /// Returns whether the unknowns are forces **v** that prove infeasibility: admissible in any
    /// multiple, without effect (G **v** = 0), and with negative work of the offset. Then every
    /// **w** would have **w**·**v** = **b**·**v** < 0, while the bounds require ≥ 0.
    fn proves_infeasible(&self, problem: &mut Problem) -> bool {
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

    /// Refines the outcome of pivoting by Newton's method; then, if G is singular, by proximal
    /// iterations, whose regularisation leads to the solution of least change.
    fn refine(&mut self, problem: &mut Problem, solution: &mut Solution, scale: f64) {
        const STEPS: usize = 30;
        const RESISTANCE: f64 = 1e-6;
        let (n, tolerance) = (problem.len(), TOLERANCE * scale);
        self.unknowns.clone_from(&problem.unknowns);
        problem.compute_steps();
        problem.update_bound_states();
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
            // The pyramid may have selected an unsuitable starting point: restart Newton's method
            // from zero.
            problem.unknowns.fill(0.0);
            let restart = problem.solve().unwrap_or_default();
            solution.factorisations += restart.factorisations;
            solution.sweeps += restart.sweeps;
            let residual = problem.residual();
            self.keep_better(problem, solution, residual);
        }
    }

    /// Stores the unknowns if their residual is lower than that of the stored ones, otherwise
    /// restores the stored ones.
    fn keep_better(&mut self, problem: &mut Problem, solution: &mut Solution, residual: f64) {
        if residual < solution.residual {
            solution.residual = residual;
            self.unknowns.clone_from(&problem.unknowns);
        } else {
            problem.unknowns.clone_from(&self.unknowns);
        }
    }
}

/// Adds the contribution of the variables to the unknowns.
fn add(variables: &[Variable], x: &[f64], factor: f64, unknowns: &mut [f64]) {
    for (variable, x) in variables.iter().zip(x) {
        if let Variable::Force { row, weights } = *variable {
            unknowns[row] += factor * weights[0] * x;
            if weights[1] != 0.0 {
                unknowns[row + 1] += factor * weights[1] * x;
            }
        }
    }
}

/// Returns the mobility between two forces.
fn mobility_between(
    problem: &Problem,
    row: usize,
    along: [f64; 2],
    column: usize,
    across: [f64; 2],
) -> f64 {
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

    /// A block of unit mass on a slope along x, which is one of the pyramid's directions: pivoting
    /// alone returns the solution for the disc. Its normal force may have a lower bound, as in the
    /// second phase of an impact.
    #[test]
    fn pyramid_equals_disc_along_its_sides() {
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
            let friction_force = f64::min(friction * force, pull / 0.5);
            let expected = [force, -friction_force, 0.0];
            for (z, expected) in problem.unknowns().iter().zip(expected) {
                assert!((z - expected).abs() < 1e-12, "{:?}", problem.unknowns());
            }
        }
    }
}
