//! Solution methods, solver statistics and errors.

/// Solution method; [the crate documentation](crate) describes when to use which.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Method {
    /// Semismooth Newton iteration: guessed bound states determine a linear system, whose solution
    /// determines the next bound states; sweeps where the iteration does not converge.
    /// [`Problem::solve`](crate::Problem::solve).
    #[default]
    Newton,
    /// Lemke's pivoting method, which ends at a solution or with a proof of infeasibility.
    Direct,
    /// Projected Gauss–Seidel sweeps with over-relaxation (Mangasarian 1977), the solver of thesis
    /// 2.4.
    GaussSeidel {
        /// ω: relaxation factor of the correction of each row, 0 < ω < 2 \[1\].
        relaxation: f64,
        /// Maximum number of sweeps.
        sweeps: u32,
        /// Residual at which sweeps end, relative to the greatest offset \[1\].
        tolerance: f64,
    },
}

/// Work and accuracy of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solution {
    /// Projected Gauss–Seidel sweeps.
    pub sweeps: u32,
    /// Direct solves.
    pub factorisations: u32,
    /// Pivots of a tableau.
    pub pivots: u32,
    /// Greatest violation of the complementarity conditions, in units of `w`, as defined by
    /// [`Problem::residual`](crate::Problem::residual).
    pub residual: f64,
}

impl Solution {
    /// Returns the total work of two solves and the larger residual.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            sweeps: self.sweeps + other.sweeps,
            factorisations: self.factorisations + other.factorisations,
            pivots: self.pivots + other.pivots,
            residual: self.residual.max(other.residual),
        }
    }
}

/// Failure of a solver.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The residual exceeds the tolerance; the best approximation stays in
    /// [`Problem::unknowns`](crate::Problem::unknowns).
    #[error("{size} complementarity conditions are violated by {residual:e} after {sweeps} sweeps")]
    Violated {
        /// Number of conditions.
        size: usize,
        /// Sweeps performed.
        sweeps: u32,
        /// Remaining residual, in units of `w`.
        residual: f64,
    },
    /// The problem has no solution. The unknowns hold the proof **v**: forces admissible in any
    /// multiple, without effect (G **v** = 0), on which the offset does negative work (**b**·**v**
    /// < 0), whereas **w**·**v** ≥ 0 is required.
    #[error(
        "no forces satisfy the {size} complementarity conditions: proved infeasible by {pivots} pivots"
    )]
    Infeasible {
        /// Number of conditions.
        size: usize,
        /// Pivots performed.
        pivots: u32,
    },
    /// Pivoting reached neither a solution nor a proof: friction admits problems without either, or
    /// G is not symmetric and positive semidefinite to working precision.
    #[error("{pivots} pivots leave {size} complementarity conditions undecided")]
    Undecided {
        /// Number of conditions.
        size: usize,
        /// Pivots performed.
        pivots: u32,
    },
    /// A parameter is out of its range.
    #[error("{what} cannot be {value}")]
    Parameter {
        /// Name of the parameter.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}
