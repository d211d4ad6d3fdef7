//! Small dense linear systems over any [`Real`] type.

use crate::model::real::Real;

/// Factors L U of a matrix by Gaussian elimination with partial pivoting.
#[derive(Debug, Clone)]
pub(crate) struct Factors<T> {
    /// By rows: U above the diagonal, the multipliers of L below, inverse pivots on it.
    entries: Vec<T>,
    /// Row exchanged with each row, in order.
    exchanges: Vec<usize>,
}

impl<T> Default for Factors<T> {
    fn default() -> Self {
        Self {
            entries: Vec::new(),
            exchanges: Vec::new(),
        }
    }
}

impl<T: Real> Factors<T> {
    /// Factors a square matrix, by rows.
    pub(crate) fn factor(&mut self, matrix: impl Iterator<Item = T>, n: usize) {
        self.entries.clear();
        self.entries.extend(matrix);
        self.exchanges.clear();
        let a = &mut self.entries[..n * n];
        for k in 0..n {
            let mut pivot = k;
            for i in k + 1..n {
                if a[i * n + k].plain().abs() > a[pivot * n + k].plain().abs() {
                    pivot = i;
                }
            }
            self.exchanges.push(pivot);
            if pivot != k {
                for j in 0..n {
                    a.swap(k * n + j, pivot * n + j);
                }
            }
            let inverse = T::splat(1.0) / a[k * n + k];
            for i in k + 1..n {
                let factor = a[i * n + k] * inverse;
                for j in k + 1..n {
                    let upper = a[k * n + j];
                    a[i * n + j] -= factor * upper;
                }
                a[i * n + k] = factor;
            }
            a[k * n + k] = inverse;
        }
    }

    /// Solves A x = b; overwrites b with x.
    pub(crate) fn solve(&self, b: &mut [T]) {
        let (a, n) = (&self.entries, b.len());
        for (k, &pivot) in self.exchanges.iter().enumerate() {
            b.swap(k, pivot);
        }
        for k in 0..n {
            let known = b[k];
            for i in k + 1..n {
                b[i] -= a[i * n + k] * known;
            }
        }
        for k in (0..n).rev() {
            let mut sum = b[k];
            for j in k + 1..n {
                sum -= a[k * n + j] * b[j];
            }
            b[k] = sum * a[k * n + k];
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Factors;

    proptest! {
        #[test]
        fn solution_satisfies_the_system(
            matrix in prop::array::uniform16(-1.0..1.0_f64),
            x in prop::array::uniform4(-1.0..1.0_f64),
        ) {
            // The dominant entries of a permutation: rows are exchanged, and the system is regular.
            let mut matrix = matrix;
            (0..4).for_each(|row| matrix[4 * row + (row + 1) % 4] += 3.5);
            let product = |x: &[f64]| -> Vec<f64> {
                let rows = matrix.chunks_exact(4);
                rows.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
            };
            let mut found = product(&x);
            let mut factors = Factors::default();
            factors.factor(matrix.iter().copied(), 4);
            factors.solve(&mut found);
            for (found, x) in found.iter().zip(&x) {
                prop_assert!((found - x).abs() < 1e-12, "{found} for {x}");
            }
        }
    }
}
