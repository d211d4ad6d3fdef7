//! Complementarity problem over a product of lines, rays, intervals and friction discs, and its
//! solvers.

use crate::bound::{Bound, BoundState};
use crate::dense::{Factors, dot, padded};
use crate::solution::{Method, Solution, SolveError};
use crate::workspace::{Direct, Phases};

/// Complementarity problem `w = G z + b` with a bound for every unknown; memory is reused from one
/// problem to the next.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Rows padded as in [`Factors`].
    pub(crate) matrix: Vec<f64>,
    pub(crate) offset: Vec<f64>,
    pub(crate) bounds: Vec<Bound>,
    /// Inverse of the diagonal of G: step size of a sweep, and the scale between forces and
    /// velocities.
    pub(crate) steps: Vec<f64>,
    pub(crate) unknowns: Vec<f64>,
    pub(crate) w: Vec<f64>,
    pub(crate) swept: Vec<f64>,
    pub(crate) best: Vec<f64>,
    /// Bound states of the factored system, and those found by the last projection.
    pub(crate) bound_states: Vec<BoundState>,
    pub(crate) next_bound_states: Vec<BoundState>,
    /// Unknowns not at a bound, the unknowns of the linear system.
    pub(crate) free: Vec<usize>,
    pub(crate) factors: Factors,
    /// Whether `bound_states`, `free` and `factors` belong to the present matrix.
    pub(crate) factored: bool,
    pub(crate) right: Vec<f64>,
    /// Whether an interval excludes zero, so that z = 0 is not admissible.
    pub(crate) shifted: bool,
    /// Rarely used, and boxed to keep the other fields close together in memory.
    pub(crate) direct: Option<Box<Direct>>,
    pub(crate) phases: Option<Box<Phases>>,
}

/// Accepted residual relative to the greatest offset: the accuracy of a direct solve at the
/// condition numbers that occur.
pub(crate) const TOLERANCE: f64 = 1e-9;

/// Residual accepted as a last resort, relative to the greatest offset.
pub(crate) const ACCEPTABLE: f64 = 1e-6;

impl Problem {
    /// Resets to a problem with `n` unknowns: all free, all entries zero.
    pub fn reset(&mut self, n: usize) {
        self.matrix.clear();
        self.matrix.resize(n * padded(n), 0.0);
        self.offset.clear();
        self.offset.resize(n, 0.0);
        self.bounds.clear();
        self.bounds.resize(n, Bound::Free);
        self.unknowns.clear();
        self.unknowns.resize(padded(n), 0.0);
        self.factored = false;
        self.shifted = false;
    }

    /// Returns the number of unknowns.
    pub fn len(&self) -> usize {
        self.offset.len()
    }

    /// Returns whether there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.offset.is_empty()
    }

    /// Sets an entry of `G`.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.factored = false;
        let stride = padded(self.len());
        self.matrix[row * stride + column] = value;
    }

    /// Adds a compliance to the diagonal of `G`, by which redundant constraints share their force
    /// equally.
    pub fn soften(&mut self, compliance: f64) {
        self.factored = false;
        let stride = padded(self.len());
        for diagonal in self.matrix.iter_mut().step_by(stride + 1) {
            *diagonal += compliance;
        }
    }

    /// Sets an entry of `b`.
    pub fn offset(&mut self, row: usize, value: f64) {
        self.offset[row] = value;
    }

    /// Sets the bound of an unknown; a [`Bound::Disc`] includes the next unknown. A friction pair
    /// remains one until [`Self::reset`], since half of a friction force has no meaning. To disable
    /// a contact, bound its normal force to zero.
    ///
    /// # Panics
    /// For an interval with `low > high`, and for an invalid friction pair: overwriting half of a
    /// pair, overlapping pairs, a normal index out of range or within a friction pair, a negative
    /// or NaN coefficient.
    pub fn bound(&mut self, row: usize, bound: Bound) {
        self.factored = false;
        match bound {
            Bound::Disc { normal, friction } => {
                self.check_pair(row, normal, friction);
                self.bounds[row + 1] = Bound::DiscSecond;
            }
            Bound::DiscSecond => panic!("row {row} is bounded by the friction pair before it"),
            Bound::Free | Bound::NonNegative | Bound::Between { .. } => {
                assert!(
                    !self.is_friction(row),
                    "row {row} is half of a friction pair"
                );
            }
        }
        if let Bound::Between { low, high } = bound {
            assert!(low <= high, "an interval from {low} to {high}");
            self.shifted |= low > 0.0 || high < 0.0;
        }
        self.bounds[row] = bound;
    }

    /// Panics for a friction pair at a row and the next that is invalid or conflicts with another
    /// pair.
    fn check_pair(&self, row: usize, normal: usize, friction: f64) {
        let (n, second) = (self.len(), row + 1);
        assert!(
            second < n,
            "a friction pair at rows {row} and {second} of {n}"
        );
        let rebound = matches!(self.bounds[row], Bound::Disc { .. });
        let bounded = self.bounds[row] == Bound::DiscSecond || self.bounds[second] != Bound::Free;
        assert!(
            rebound || !bounded,
            "the friction pair at row {row} overlaps a row with another bound"
        );
        let distinct = normal < n && normal != row && normal != second;
        assert!(
            distinct && !self.is_friction(normal),
            "row {normal} cannot be the normal force of the friction pair at row {row}"
        );
        let normal_of = |bound: &Bound| match *bound {
            Bound::Disc { normal, .. } => Some(normal),
            _ => None,
        };
        let mut normals = self.bounds.iter().filter_map(normal_of);
        assert!(
            !normals.any(|other| other == row || other == second),
            "the friction pair at row {row} is the normal force of another"
        );
        assert!(friction >= 0.0, "a friction coefficient of {friction}");
    }

    /// Returns whether a row belongs to a friction pair.
    fn is_friction(&self, row: usize) -> bool {
        matches!(self.bounds[row], Bound::Disc { .. } | Bound::DiscSecond)
    }

    /// Sets the initial guess of an unknown, such as its value in a similar problem.
    pub fn guess(&mut self, row: usize, value: f64) {
        self.unknowns[row] = value;
    }

    /// Returns the solution `z`.
    pub fn unknowns(&self) -> &[f64] {
        &self.unknowns[..self.len()]
    }

    /// Solves the problem by a semismooth Newton iteration: the guess determines the bound states
    /// of the unknowns, which direct solves correct until they are consistent. Where the iteration
    /// does not converge, projected Gauss–Seidel sweeps provide the next guess.
    ///
    /// # Errors
    /// [`SolveError`] where no iteration converges; the best approximation stays in
    /// [`Self::unknowns`].
    pub fn solve(&mut self) -> Result<Solution, SolveError> {
        self.solve_within(TOLERANCE, 0.0)
    }

    /// Solves as [`Self::solve`] does, within the larger of two tolerances: one relative to the
    /// greatest offset, one absolute in units of `w`. Intermediate solutions of an iteration need
    /// less accuracy.
    ///
    /// # Errors
    /// [`SolveError`] where no iteration converges; the best approximation stays in
    /// [`Self::unknowns`].
    pub fn solve_within(&mut self, relative: f64, absolute: f64) -> Result<Solution, SolveError> {
        const ROUNDS: u32 = 8;
        let mut solution = Solution::default();
        let scale = self.scale();
        if scale == 0.0 {
            for row in 0..self.len() {
                self.unknowns[row] = self.nearest_to_zero(row);
            }
            return Ok(solution);
        }
        if !scale.is_finite() {
            return Err(self.unsolvable());
        }
        let tolerance = absolute.max(relative * scale);
        if self.factored {
            self.solve_active_set();
            solution.residual = self.update_bound_states();
            if solution.residual <= tolerance {
                return Ok(solution);
            }
        } else {
            self.compute_steps();
            self.update_bound_states();
        }
        let mut best = f64::INFINITY;
        for round in 0..ROUNDS {
            if round > 0 {
                let sweeps = 1 << (2 * round.min(5));
                for _ in 0..sweeps {
                    self.sweep(1.0);
                }
                solution.sweeps += sweeps;
                self.update_bound_states();
            }
            self.swept.clone_from(&self.unknowns);
            solution.residual = self.newton(&mut solution.factorisations, tolerance);
            if solution.residual <= tolerance {
                return Ok(solution);
            }
            if solution.residual < best {
                best = solution.residual;
                self.best.clone_from(&self.unknowns);
            }
            self.unknowns.clone_from(&self.swept);
        }
        solution.residual = self.update_bound_states();
        if best < solution.residual {
            self.unknowns.clone_from(&self.best);
            solution.residual = best;
        }
        if solution.residual <= absolute.max(ACCEPTABLE * scale) {
            return Ok(solution);
        }
        Err(SolveError::Violated {
            size: self.len(),
            sweeps: solution.sweeps,
            residual: solution.residual,
        })
    }

    /// Solves the problem by the selected method. The guess matters to [`Method::GaussSeidel`], and
    /// to [`Method::Newton`] where there are several solutions; [`Method::Direct`] ignores it.
    ///
    /// # Errors
    /// [`SolveError`], as described for the method; the variant documents the state of the unknowns.
    pub fn solve_by(&mut self, method: Method) -> Result<Solution, SolveError> {
        match method {
            Method::Newton => self.solve(),
            Method::Direct => self.solve_directly(),
            Method::GaussSeidel {
                relaxation,
                sweeps,
                tolerance,
            } => self.solve_by_sweeps(relaxation, sweeps, tolerance),
        }
    }

    /// Projects the unknowns onto their bounds and returns whether any of them changed. A solution
    /// satisfies its bounds only within its tolerance; where a bound is a physical law, such as
    /// Coulomb's, it must hold exactly, so that the remaining error is one of velocities alone.
    pub fn project_onto_bounds(&mut self) -> bool {
        /// Excess over the bound that is left uncorrected, relative to the bound: its projection
        /// would replace it by a velocity error.
        const EXCESS: f64 = 5e-7;
        let mut outside = false;
        for row in 0..self.len() {
            let z = self.unknowns[row];
            match self.bounds[row] {
                Bound::Free | Bound::DiscSecond => {}
                Bound::NonNegative => self.unknowns[row] = z.max(0.0),
                Bound::Between { low, high } => self.unknowns[row] = z.max(low).min(high),
                Bound::Disc { normal, friction } => {
                    let length = norm([z, self.unknowns[row + 1]]);
                    let radius = friction * self.unknowns[normal].max(0.0);
                    if length > radius * (1.0 + EXCESS) {
                        self.unknowns[row] *= radius / length;
                        self.unknowns[row + 1] *= radius / length;
                    }
                }
            }
            outside |= self.unknowns[row] != z;
        }
        outside
    }

    /// Returns `w = G z + b` of a row, for the present unknowns.
    pub fn w(&self, row: usize) -> f64 {
        let stride = self.unknowns.len();
        self.offset[row]
            + dot(
                stride,
                &self.matrix[row * stride..(row + 1) * stride],
                &self.unknowns,
            )
    }

    /// Returns an entry of `G`.
    pub(crate) fn entry(&self, row: usize, column: usize) -> f64 {
        self.matrix[row * padded(self.len()) + column]
    }

    /// Returns the scale of residuals: the greatest offset, including the effect of intervals that
    /// exclude zero.
    pub(crate) fn scale(&self) -> f64 {
        let greatest = |largest: f64, b: &f64| largest.max(b.abs());
        let mut scale = self.offset.iter().fold(0.0_f64, greatest);
        // `max` discards NaN, so offsets that are all zero or NaN need an explicit check.
        if scale == 0.0 && self.offset.iter().any(|b| b.is_nan()) {
            return f64::INFINITY;
        }
        if self.shifted {
            let n = self.len();
            for row in 0..n {
                let moved = (0..n).map(|j| self.entry(row, j) * self.nearest_to_zero(j));
                scale = scale.max((self.offset[row] + moved.sum::<f64>()).abs());
            }
        }
        scale
    }

    /// Returns the error for entries that are not finite.
    pub(crate) fn unsolvable(&self) -> SolveError {
        SolveError::Violated {
            size: self.len(),
            sweeps: 0,
            residual: f64::INFINITY,
        }
    }

    /// Returns the admissible value nearest to zero.
    pub(crate) fn nearest_to_zero(&self, row: usize) -> f64 {
        match self.bounds[row] {
            Bound::Between { low, high } => 0.0_f64.clamp(low, high),
            _ => 0.0,
        }
    }
}

pub(crate) fn norm(v: [f64; 2]) -> f64 {
    libm::sqrt(v[0] * v[0] + v[1] * v[1])
}

#[cfg(test)]
mod tests;
