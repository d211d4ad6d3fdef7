//! Small dense linear systems.

/// The matrix has no inverse, to working precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a linear system of {size} rows is singular at column {column}")]
pub struct Singular {
    /// Rows of the system.
    pub size: usize,
    /// Column in which elimination found no pivot.
    pub column: usize,
}

/// Row lengths are padded with zeros to multiples of this. Loops over rows then have few distinct
/// lengths, and for the common short ones [`for_length`] instantiates a version with a compile-time
/// length: unrolled, in vector registers, and with the same operations in the same order on every
/// machine.
const LANE: usize = 4;

/// Returns the length of a padded row of `n` numbers.
pub(crate) const fn padded(n: usize) -> usize {
    n.div_ceil(LANE) * LANE
}

/// Calls a function with its length argument as a literal for the common lengths.
macro_rules! for_length {
    ($length:expr, $call:ident($($argument:expr),*)) => {
        match $length {
            4 => $call(4, $($argument),*),
            8 => $call(8, $($argument),*),
            12 => $call(12, $($argument),*),
            16 => $call(16, $($argument),*),
            20 => $call(20, $($argument),*),
            24 => $call(24, $($argument),*),
            length => $call(length, $($argument),*),
        }
    };
}

/// Computes `y = b + A x` for a matrix of padded rows and a padded x.
pub(crate) fn affine(a: &[f64], x: &[f64], b: &[f64], y: &mut [f64]) {
    for_length!(x.len(), affine_of(a, x, b, y));
}

#[inline(always)]
fn affine_of(length: usize, a: &[f64], x: &[f64], b: &[f64], y: &mut [f64]) {
    let x = &x[..length];
    for ((row, b), y) in a.chunks_exact(length).zip(b).zip(y) {
        *y = b + dot(length, row, x);
    }
}

/// Returns the dot product of two padded rows, accumulated in four interleaved sums.
#[inline(always)]
pub(crate) fn dot(length: usize, a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (&a[..length], &b[..length]);
    let mut sum = [0.0; LANE];
    for (a, b) in a.chunks_exact(LANE).zip(b.chunks_exact(LANE)) {
        for k in 0..LANE {
            sum[k] += a[k] * b[k];
        }
    }
    (sum[0] + sum[2]) + (sum[1] + sum[3])
}

/// LU decomposition with partial pivoting, and its memory.
#[derive(Debug, Clone, Default)]
pub struct Factors {
    n: usize,
    /// U with unit diagonal; rows padded.
    upper: Vec<f64>,
    /// Columns of L below its diagonal, zero above; padded.
    lower: Vec<f64>,
    /// Inverses of L's diagonal.
    inverses: Vec<f64>,
    /// Row exchanged with row k at elimination step k.
    pivots: Vec<usize>,
}

impl Factors {
    /// Allocates an `n × n` matrix and returns it to be filled: rows of [`Self::stride`] numbers,
    /// all zero, of which the first `n` are used.
    pub fn matrix(&mut self, n: usize) -> &mut [f64] {
        let size = n * padded(n);
        self.n = n;
        self.upper.clear();
        self.upper.resize(size, 0.0);
        self.lower.clear();
        self.lower.resize(size, 0.0);
        self.inverses.resize(n, 0.0);
        self.pivots.resize(n, 0);
        &mut self.upper
    }

    /// Returns the length of a row of the matrix in memory.
    pub fn stride(&self) -> usize {
        padded(self.n)
    }

    /// Decomposes the matrix returned by [`Self::matrix`].
    ///
    /// # Errors
    /// [`Singular`] where no pivot exceeds 1e-300.
    pub fn factor(&mut self) -> Result<(), Singular> {
        for_length!(self.stride(), factor_of(self))
    }

    /// Solves `A x = b` with the decomposition; `x` overwrites the first `n` numbers of `b`, which
    /// is padded.
    pub fn solve(&self, b: &mut [f64]) {
        for_length!(self.stride(), solve_of(self, b));
    }
}

#[inline(always)]
fn factor_of(stride: usize, factors: &mut Factors) -> Result<(), Singular> {
    const TINY: f64 = 1e-300;
    let n = factors.n;
    for column in 0..n {
        let (above, below) = factors.upper.split_at_mut((column + 1) * stride);
        let pivot_row = &mut above[column * stride..][..stride];
        let mut largest = (0, pivot_row[column].abs());
        for (i, row) in below.chunks_exact(stride).enumerate() {
            if row[column].abs() > largest.1 {
                largest = (i + 1, row[column].abs());
            }
        }
        if largest.1.is_nan() || largest.1 <= TINY {
            return Err(Singular { size: n, column });
        }
        factors.pivots[column] = column + largest.0;
        if largest.0 != 0 {
            pivot_row.swap_with_slice(&mut below[(largest.0 - 1) * stride..][..stride]);
        }
        let multipliers = &mut factors.lower[column * stride..][..stride];
        let inverse = 1.0 / pivot_row[column];
        factors.inverses[column] = inverse;
        for x in pivot_row.iter_mut() {
            *x *= inverse;
        }
        // Entries left of the column are zero in this row and in those below, so whole rows can be
        // processed.
        pivot_row[column] = 1.0;
        for (row, multiplier) in below
            .chunks_exact_mut(stride)
            .zip(&mut multipliers[column + 1..])
        {
            let factor = row[column];
            *multiplier = factor;
            for (x, p) in row.iter_mut().zip(&*pivot_row) {
                *x -= factor * p;
            }
        }
    }
    Ok(())
}

#[inline(always)]
fn solve_of(stride: usize, factors: &Factors, b: &mut [f64]) {
    let b = &mut b[..stride];
    let columns = factors.lower.chunks_exact(stride.max(1));
    for (i, (multipliers, (&pivot, inverse))) in columns
        .zip(factors.pivots.iter().zip(&factors.inverses))
        .enumerate()
    {
        b.swap(i, pivot);
        let x = b[i] * inverse;
        for (b, l) in b.iter_mut().zip(multipliers) {
            *b -= l * x;
        }
        b[i] = x;
    }
    for (i, row) in factors.upper.chunks_exact(stride.max(1)).enumerate().rev() {
        // The row has zeros before the diagonal and a one on it, which multiplies this zero.
        let right = std::mem::take(&mut b[i]);
        b[i] = right - dot(stride, row, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solution_satisfies_linear_system(n in 1..12_usize, seed in proptest::collection::vec(-1.0..1.0_f64, 156)) {
            let mut a: Vec<f64> = seed[..n * n].to_vec();
            // A cyclically shifted dominant diagonal keeps the condition number small, which makes
            // the tolerance meaningful, and requires pivoting.
            for i in 0..n {
                a[i * n + (i + 1) % n] += 6.0;
            }
            let right: Vec<f64> = seed[144..144 + n].to_vec();
            let (mut factors, mut x) = (Factors::default(), right.clone());
            for (row, values) in factors.matrix(n).chunks_exact_mut(padded(n)).zip(a.chunks_exact(n)) {
                row[..n].copy_from_slice(values);
            }
            factors.factor().unwrap();
            x.resize(padded(n), 0.0);
            factors.solve(&mut x);
            for i in 0..n {
                let product: f64 = (0..n).map(|j| a[i * n + j] * x[j]).sum();
                prop_assert!((product - right[i]).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn singular_matrix_is_reported_with_column() {
        let mut factors = Factors::default();
        let matrix = factors.matrix(2);
        (
            matrix[0],
            matrix[1],
            matrix[padded(2)],
            matrix[padded(2) + 1],
        ) = (1.0, 2.0, 2.0, 4.0);
        assert_eq!(factors.factor(), Err(Singular { size: 2, column: 1 }));
        factors.matrix(1)[0] = f64::NAN;
        assert!(factors.factor().is_err());
    }
}
