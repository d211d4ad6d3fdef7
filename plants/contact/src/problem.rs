//! A complementarity problem over a product of lines, rays, intervals and friction discs, and its solvers.

use crate::dense::{Factors, dot, padded};
use crate::direct::Direct;
use crate::impact::Phases;
use crate::solution::{Method, Solution, Unsolved};

/// What an unknown may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Anything: `w = 0`.
    Free,
    /// `0 ≤ z ⊥ w ≥ 0`.
    NonNegative,
    /// `low ≤ z ≤ high`; `w` is zero inside, ≥ 0 at `low`, ≤ 0 at `high`.
    Between {
        /// Least value.
        low: f64,
        /// Greatest value.
        high: f64,
    },
    /// This unknown and the next are a friction force: `|z| ≤ friction · z[normal]`, with `w` against `z` where it slips
    /// (Coulomb; the principle of greatest dissipation).
    Disc {
        /// Index of the normal force.
        normal: usize,
        /// Coulomb coefficient.
        friction: f64,
    },
    /// The second component of the [`Bound::Disc`] before it, which sets it.
    DiscSecond,
}

/// Where an unknown stands in its bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    Inside,
    Low,
    High,
    /// On the border of the disc, in this direction; the share is its radius over the distance of what it was projected
    /// from.
    Slipping {
        /// Unit vector.
        direction: [f64; 2],
        /// At most one.
        share: f64,
    },
}

/// `w = G z + b` with a bound for every unknown; its memory is kept from one use to the next.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Rows padded as in [`Factors`].
    pub(crate) matrix: Vec<f64>,
    pub(crate) offset: Vec<f64>,
    pub(crate) bounds: Vec<Bound>,
    /// Inverse of the diagonal: the step of a sweep, and what makes forces and velocities comparable.
    pub(crate) steps: Vec<f64>,
    pub(crate) unknowns: Vec<f64>,
    pub(crate) w: Vec<f64>,
    pub(crate) swept: Vec<f64>,
    pub(crate) best: Vec<f64>,
    /// Where each unknown stands in the factored system, and where the last projection put it.
    pub(crate) places: Vec<Place>,
    pub(crate) next: Vec<Place>,
    /// Unknowns not at a bound: those of the linear system.
    pub(crate) free: Vec<usize>,
    pub(crate) factors: Factors,
    /// Whether `places`, `free` and `factors` belong to the present matrix.
    pub(crate) factored: bool,
    pub(crate) right: Vec<f64>,
    /// Whether there is an interval without zero: then zero is not what no force at all stands for.
    pub(crate) shifted: bool,
    /// What few ask for; apart, so that the rest lies close together.
    pub(crate) direct: Option<Box<Direct>>,
    pub(crate) phases: Option<Box<Phases>>,
}

/// Accepted residual, relative to the greatest offset: what a direct solve leaves at the condition numbers that occur.
pub(crate) const TOLERANCE: f64 = 1e-9;

/// Residual that is accepted where nothing better is found, relative to the greatest offset.
pub(crate) const ACCEPTABLE: f64 = 1e-6;

impl Problem {
    /// Starts a problem with `n` unknowns: all free, everything zero.
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

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.offset.len()
    }

    /// Whether there is nothing to solve.
    pub fn is_empty(&self) -> bool {
        self.offset.is_empty()
    }

    /// Sets an entry of `G`.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.factored = false;
        let stride = padded(self.len());
        self.matrix[row * stride + column] = value;
    }

    /// Adds to the diagonal of `G`, which makes constraints that say the same thing twice share their force equally.
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

    /// Sets the bound of an unknown; a [`Bound::Disc`] takes the next one with it. A friction pair stays one until
    /// [`Self::reset`]: half of a friction force has no meaning. Where a contact is to push no more, its normal is bounded.
    ///
    /// # Panics
    /// For an interval whose ends are not in order, and for a friction pair that is none: half of one overwritten, two that
    /// overlap, a normal that is not there or is itself friction, a coefficient that is negative or NaN.
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

    /// Refuses a friction pair at a row and the next that contradicts itself or another pair.
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
            "the friction pair at row {row} overlaps what is bounded otherwise"
        );
        let apart = normal < n && normal != row && normal != second;
        assert!(
            apart && !self.is_friction(normal),
            "row {normal} is no normal force for the friction pair at row {row}"
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

    /// Whether a row belongs to a friction pair.
    fn is_friction(&self, row: usize) -> bool {
        matches!(self.bounds[row], Bound::Disc { .. } | Bound::DiscSecond)
    }

    /// Sets a guess of an unknown, such as its value in a problem much like this one.
    pub fn guess(&mut self, row: usize, value: f64) {
        self.unknowns[row] = value;
    }

    /// The solution `z`.
    pub fn unknowns(&self) -> &[f64] {
        &self.unknowns[..self.len()]
    }

    /// Solves the problem: the guess says where each unknown stands in its bound, direct solves correct it until it
    /// confirms itself (a semismooth Newton iteration), and projected Gauss–Seidel sweeps make a better guess where it
    /// does not.
    ///
    /// # Errors
    /// [`Unsolved`] where no guess confirms itself; the best approximation stays in [`Self::unknowns`].
    pub fn solve(&mut self) -> Result<Solution, Unsolved> {
        self.solve_within(TOLERANCE, 0.0)
    }

    /// [`Self::solve`] with tolerances of one's own, relative to the greatest offset and in units of `w`; the larger of the
    /// two counts. A solution that is only a step on the way to another need not be a good one.
    ///
    /// # Errors
    /// [`Unsolved`] where no guess confirms itself; the best approximation stays in [`Self::unknowns`].
    pub fn solve_within(&mut self, relative: f64, absolute: f64) -> Result<Solution, Unsolved> {
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
            self.solve_at_places();
            solution.residual = self.judge();
            if solution.residual <= tolerance {
                return Ok(solution);
            }
        } else {
            self.measure();
            self.judge();
        }
        let mut best = f64::INFINITY;
        for round in 0..ROUNDS {
            if round > 0 {
                let sweeps = 1 << (2 * round.min(5));
                for _ in 0..sweeps {
                    self.sweep(1.0);
                }
                solution.sweeps += sweeps;
                self.judge();
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
        solution.residual = self.judge();
        if best < solution.residual {
            self.unknowns.clone_from(&self.best);
            solution.residual = best;
        }
        if solution.residual <= absolute.max(ACCEPTABLE * scale) {
            return Ok(solution);
        }
        Err(Unsolved::Violated {
            size: self.len(),
            sweeps: solution.sweeps,
            residual: solution.residual,
        })
    }

    /// Solves the problem by a method of one's choice. The guess matters to [`Method::GaussSeidel`], and to
    /// [`Method::Newton`] where there are several solutions; [`Method::Direct`] does not look at it.
    ///
    /// # Errors
    /// [`Unsolved`], by what the method can tell; the unknowns then hold what it says.
    pub fn solve_by(&mut self, method: Method) -> Result<Solution, Unsolved> {
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

    /// Projects the unknowns onto their bounds. A solution keeps them within its tolerance; where a
    /// law of nature is among them, as Coulomb's is, the rest is to be an error of velocities alone. Says whether there was anything to project.
    pub fn keep_within_bounds(&mut self) -> bool {
        /// An excess that is left, relative to the bound: a projection trades it for a velocity.
        const LEFT: f64 = 5e-7;
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
                    if length > radius * (1.0 + LEFT) {
                        self.unknowns[row] *= radius / length;
                        self.unknowns[row + 1] *= radius / length;
                    }
                }
            }
            outside |= self.unknowns[row] != z;
        }
        outside
    }

    /// `w = G z + b` of a row, for the present unknowns.
    pub fn w(&self, row: usize) -> f64 {
        let stride = self.unknowns.len();
        self.offset[row]
            + dot(
                stride,
                &self.matrix[row * stride..(row + 1) * stride],
                &self.unknowns,
            )
    }

    /// An entry of `G`.
    pub(crate) fn entry(&self, row: usize, column: usize) -> f64 {
        self.matrix[row * padded(self.len()) + column]
    }

    /// What residuals are relative to: the greatest offset, with what bounds that exclude zero do to it.
    pub(crate) fn scale(&self) -> f64 {
        let greatest = |most: f64, b: &f64| most.max(b.abs());
        let mut scale = self.offset.iter().fold(0.0_f64, greatest);
        // `max` lets go of what is not a number; where that is all there is, nothing else would tell.
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

    /// The answer to what is not in numbers.
    pub(crate) fn unsolvable(&self) -> Unsolved {
        Unsolved::Violated {
            size: self.len(),
            sweeps: 0,
            residual: f64::INFINITY,
        }
    }

    /// What a bound allows nearest to no force.
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
