//! Projected Gauss–Seidel sweeps with over-relaxation: z ← Π(z − ω ρ w), row by row, each with the
//! updated values of the rows before it. ρ is the inverse of the row's diagonal entry of G, so that
//! ω = 1 solves the row; for a friction disc, the inverse of the larger eigenvalue of its 2 × 2
//! block.

use crate::bound::Bound;
use crate::dense::padded;
use crate::problem::{Problem, norm};
use crate::solution::{Solution, SolveError};

impl Problem {
    /// Sweeps until the residual is within the tolerance.
    pub(crate) fn solve_by_sweeps(
        &mut self,
        relaxation: f64,
        sweeps: u32,
        tolerance: f64,
    ) -> Result<Solution, SolveError> {
        if !(relaxation > 0.0 && relaxation < 2.0) {
            return Err(SolveError::Parameter {
                what: "relaxation",
                value: relaxation,
            });
        }
        let scale = self.scale();
        if !scale.is_finite() {
            return Err(self.unsolvable());
        }
        let allowed = tolerance * scale;
        self.factored = false;
        self.compute_steps();
        self.limit_disc_steps();
        // A row of zero mobility keeps its guess, which must satisfy its bound; all admissible
        // values are equivalent.
        for row in 0..self.len() {
            if self.steps[row] == 0.0 {
                self.unknowns[row] = self.nearest_to_zero(row);
            }
        }
        let mut solution = Solution::default();
        loop {
            solution.residual = self.residual();
            if solution.residual <= allowed {
                return Ok(solution);
            }
            if solution.sweeps >= sweeps || solution.residual.is_infinite() {
                return Err(SolveError::Violated {
                    size: self.len(),
                    sweeps: solution.sweeps,
                    residual: solution.residual,
                });
            }
            // The change made by a sweep approximates the residual before it, at no additional
            // cost.
            while solution.sweeps < sweeps {
                solution.sweeps += 1;
                if self.sweep(relaxation) <= allowed {
                    break;
                }
            }
        }
    }

    /// Computes the step sizes ρ of the rows.
    pub(crate) fn compute_steps(&mut self) {
        let next = padded(self.len()) + 1;
        self.steps.clear();
        for row in 0..self.len() {
            let entry = self.matrix[row * next];
            let diagonal = match self.bounds[row] {
                Bound::Disc { .. } => entry.max(self.matrix[(row + 1) * next]),
                Bound::DiscSecond => entry.max(self.matrix[(row - 1) * next]),
                _ => entry,
            };
            self.steps
                .push(if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 });
        }
    }

    /// Reduces the steps of discs to the inverse of the larger eigenvalue of their block of G,
    /// since both components are updated at once: with the larger of its diagonal entries, strongly
    /// coupled components would oscillate with growing amplitude.
    fn limit_disc_steps(&mut self) {
        for row in 0..self.len() {
            if let Bound::Disc { .. } = self.bounds[row] {
                let (a, b) = (self.entry(row, row), self.entry(row + 1, row + 1));
                let coupling = self.entry(row, row + 1);
                let largest = 0.5 * (a + b) + norm([0.5 * (a - b), coupling]);
                if largest > 0.0 {
                    self.steps[row] = 1.0 / largest;
                    self.steps[row + 1] = 1.0 / largest;
                }
            }
        }
    }

    /// Performs one sweep over all rows. Returns the greatest change, in units of `w`.
    pub(crate) fn sweep(&mut self, relaxation: f64) -> f64 {
        let mut largest = 0.0_f64;
        for row in 0..self.len() {
            let (z, step) = (self.unknowns[row], relaxation * self.steps[row]);
            let mut change = 0.0;
            match self.bounds[row] {
                Bound::Free => self.unknowns[row] = z - step * self.w(row),
                Bound::NonNegative => self.unknowns[row] = (z - step * self.w(row)).max(0.0),
                Bound::Between { low, high } => {
                    self.unknowns[row] = (z - step * self.w(row)).clamp(low, high);
                }
                Bound::Disc { normal, friction } => {
                    let other = self.unknowns[row + 1];
                    let t = [z - step * self.w(row), other - step * self.w(row + 1)];
                    let (radius, length) = (friction * self.unknowns[normal].max(0.0), norm(t));
                    let shrink = if length > radius {
                        radius / length
                    } else {
                        1.0
                    };
                    self.unknowns[row] = t[0] * shrink;
                    self.unknowns[row + 1] = t[1] * shrink;
                    change = (self.unknowns[row + 1] - other).abs();
                }
                Bound::DiscSecond => continue,
            }
            change = change.max((self.unknowns[row] - z).abs());
            if step > 0.0 {
                largest = largest.max(change / step);
            }
        }
        largest
    }
}
