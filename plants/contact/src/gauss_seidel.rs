//! Projected Gauss–Seidel sweeps, with over-relaxation: z ← Π(z − ω ρ w), row by row, each seeing what those before it
//! have become. ρ is the inverse of the row's own entry of G, so that ω = 1 solves the row; of a disc's own block, the
//! inverse of the larger eigenvalue.

use crate::dense::padded;
use crate::problem::{Bound, Problem, norm};
use crate::solution::{Solution, Unsolved};

impl Problem {
    /// Sweeps until the residual is within the tolerance.
    pub(crate) fn solve_by_sweeps(
        &mut self,
        relaxation: f64,
        sweeps: u32,
        tolerance: f64,
    ) -> Result<Solution, Unsolved> {
        if !(relaxation > 0.0 && relaxation < 2.0) {
            return Err(Unsolved::Parameter {
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
        self.measure();
        self.slow_discs();
        // A row that nothing moves keeps its guess, which its bound must allow; none is as good as any.
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
                return Err(Unsolved::Violated {
                    size: self.len(),
                    sweeps: solution.sweeps,
                    residual: solution.residual,
                });
            }
            // What a sweep changes is close to the residual before it, and costs nothing.
            while solution.sweeps < sweeps {
                solution.sweeps += 1;
                if self.sweep(relaxation) <= allowed {
                    break;
                }
            }
        }
    }

    /// Finds the steps of the rows.
    pub(crate) fn measure(&mut self) {
        let next = padded(self.len()) + 1;
        self.steps.clear();
        for row in 0..self.len() {
            let own = self.matrix[row * next];
            let diagonal = match self.bounds[row] {
                Bound::Disc { .. } => own.max(self.matrix[(row + 1) * next]),
                Bound::DiscSecond => own.max(self.matrix[(row - 1) * next]),
                _ => own,
            };
            self.steps
                .push(if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 });
        }
    }

    /// Steps of discs by the larger eigenvalue of their own block of G, for both components go at once: by the larger of
    /// its diagonal entries, strongly coupled ones would swing up.
    fn slow_discs(&mut self) {
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

    /// One sweep over all rows. Gives the greatest change that it made, in units of `w`.
    pub(crate) fn sweep(&mut self, relaxation: f64) -> f64 {
        let mut most = 0.0_f64;
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
                most = most.max(change / step);
            }
        }
        most
    }
}
