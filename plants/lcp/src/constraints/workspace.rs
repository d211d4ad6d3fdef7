//! Workspace of the contact forces, and their system of equations.

use crate::model::articulated::{Articulated, Response, Row, cross_mobility};
use crate::model::dense::Factors;
use crate::model::real::{Real, Wide};

/// Workspace of the contact forces of a right-hand side.
#[derive(Debug, Clone)]
pub(crate) struct Workspace<T, const N: usize> {
    pub(super) rows: Vec<Row<T, N>>,
    pub(super) force_rows: Vec<Row<T, N>>,
    pub(super) responses: Vec<Response<T, N>>,
    pub(super) matrix: Vec<T>,
    pub(super) factors: Factors<T>,
    pub(super) known: Vec<T>,
    pub(crate) forces: Vec<T>,
    /// By row, the share of a normal's mobility that sliding friction leaves; one without sliding.
    pub(crate) normal_shares: Vec<f64>,
}

impl<T, const N: usize> Default for Workspace<T, N> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            force_rows: Vec::new(),
            responses: Vec::new(),
            matrix: Vec::new(),
            factors: Factors::default(),
            known: Vec::new(),
            forces: Vec::new(),
            normal_shares: Vec::new(),
        }
    }
}

impl<T: Real, const N: usize> Workspace<T, N> {
    /// Fills the matrix: accelerations along each row by unit forces.
    pub(super) fn fill<R: Wide<Sum = T>>(&mut self, articulated: &Articulated<R, N>) {
        let n = self.rows.len();
        self.matrix.clear();
        for row in 0..n {
            let response = articulated.response(&self.rows[row]);
            for column in 0..n {
                let mut entry = cross_mobility(
                    &self.rows[row],
                    &response.pull,
                    &self.force_rows[column],
                    &self.responses[column],
                );
                if row == column {
                    if self.normal_shares[row] == 0.0 {
                        let (upright, pull) = (&self.rows[row], &response.pull);
                        let normal = cross_mobility(upright, pull, upright, &response);
                        self.normal_shares[row] = entry.plain() / normal.plain();
                    }
                    // A row without mobility has no force.
                    if entry.plain() <= 0.0 {
                        entry = T::splat(1.0);
                        self.forces[row] = T::zero();
                    }
                }
                self.matrix.push(entry);
            }
        }
    }

    /// Solves A λ = b for the forces, b being their present values. Redundant constraints share
    /// their force: by (A + ε)⁻¹ A (A + ε)⁻¹ b with a small compliance ε, the solution of least
    /// norm. A single (A + ε)⁻¹ would divide by ε any error of b that no forces cancel, as that of
    /// two feet which hold each other.
    pub(super) fn solve(&mut self, compliance: f64) {
        let n = self.forces.len();
        let Self {
            matrix,
            factors,
            known,
            forces,
            ..
        } = self;
        let entries = matrix.iter().enumerate().map(|(k, &entry)| {
            if k % (n + 1) == 0 {
                entry + T::splat(compliance)
            } else {
                entry
            }
        });
        factors.factor(entries, n);
        factors.solve(forces);
        known.clear();
        known.extend(matrix.chunks_exact(n.max(1)).map(|row| {
            let terms = row.iter().zip(&*forces);
            terms.fold(T::zero(), |sum, (&entry, &force)| sum + entry * force)
        }));
        factors.solve(known);
        core::mem::swap(known, forces);
    }
}
