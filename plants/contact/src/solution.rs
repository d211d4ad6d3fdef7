//! How a problem was solved, or why it was not.

/// How a problem is solved; [the crate's page](crate) says when to use which.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Method {
    /// Where each unknown stands in its bound is guessed, a linear system follows from it, and its solution is the next
    /// guess (a semismooth Newton iteration); sweeps where that does not settle. [`Problem::solve`](crate::Problem::solve).
    #[default]
    Newton,
    /// Pivots (Lemke's method) that end at a solution or with a proof that there is none.
    Direct,
    /// Projected Gauss–Seidel sweeps with over-relaxation (Mangasarian 1977), the solver of thesis 2.4.
    GaussSeidel {
        /// ω: how far a sweep goes along each row's own correction, 0 < ω < 2 \[1\].
        relaxation: f64,
        /// Most sweeps.
        sweeps: u32,
        /// Residual at which sweeping ends, relative to the greatest offset \[1\].
        tolerance: f64,
    },
}

/// How a problem was solved.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solution {
    /// Projected Gauss–Seidel sweeps.
    pub sweeps: u32,
    /// Direct solves.
    pub factorisations: u32,
    /// Exchanges of two variables in a tableau.
    pub pivots: u32,
    /// Greatest violation of the complementarity conditions, in units of `w`;
    /// [`Problem::residual`](crate::Problem::residual) is its definition.
    pub residual: f64,
}

impl Solution {
    /// The work of two solves, with the residual of the worse.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            sweeps: self.sweeps + other.sweeps,
            factorisations: self.factorisations + other.factorisations,
            pivots: self.pivots + other.pivots,
            residual: self.residual.max(other.residual),
        }
    }
}

/// The solver found no solution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unsolved {
    /// What was found is not good enough; the best of it stays in [`Problem::unknowns`](crate::Problem::unknowns).
    #[error(
        "{size} complementarity conditions stay violated by {residual:e} after {sweeps} sweeps"
    )]
    Violated {
        /// Number of conditions.
        size: usize,
        /// Sweeps made.
        sweeps: u32,
        /// What is left, in units of `w`.
        residual: f64,
    },
    /// There is no solution. The unknowns are left as the proof **v**: forces that their bounds allow in any multiple, that
    /// move nothing (G **v** = 0), and on which the offset works (**b**·**v** < 0), whereas **w**·**v** must not be negative.
    #[error("no forces meet the {size} complementarity conditions, as {pivots} pivots prove")]
    Infeasible {
        /// Number of conditions.
        size: usize,
        /// Pivots made.
        pivots: u32,
    },
    /// Pivoting came to neither a solution nor a proof: there is friction, which may leave none without a proof, or G is
    /// not symmetric and positive semidefinite to working precision.
    #[error("{pivots} pivots leave {size} complementarity conditions undecided")]
    Undecided {
        /// Number of conditions.
        size: usize,
        /// Pivots made.
        pivots: u32,
    },
    /// A parameter is out of its range.
    #[error("{what} cannot be {value}")]
    Parameter {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}
