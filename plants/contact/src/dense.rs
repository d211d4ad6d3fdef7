//! Small dense linear systems.

/// The matrix has no inverse, to working precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a linear system of {size} rows is singular at column {column}")]
pub struct Singular {
    /// Rows of the system.
    pub size: usize,
    /// Where elimination found no pivot.
    pub column: usize,
}

/// Solves `A x = b` by Gaussian elimination with partial pivoting; `x` replaces `b`, and `A` (row-major, `n × n`) is
/// used up.
///
/// # Errors
/// [`Singular`] where no pivot exceeds 1e-300.
pub fn solve_in_place(a: &mut [f64], b: &mut [f64]) -> Result<(), Singular> {
    const TINY: f64 = 1e-300;
    let n = b.len();
    debug_assert_eq!(a.len(), n * n);
    for column in 0..n {
        let mut pivot = column;
        for row in column + 1..n {
            if a[row * n + column].abs() > a[pivot * n + column].abs() {
                pivot = row;
            }
        }
        let value = a[pivot * n + column];
        if value.is_nan() || value.abs() <= TINY {
            return Err(Singular { size: n, column });
        }
        if pivot != column {
            for j in column..n {
                a.swap(column * n + j, pivot * n + j);
            }
            b.swap(column, pivot);
        }
        let inverse = 1.0 / value;
        let (above, below) = a.split_at_mut((column + 1) * n);
        let pivot_row = &above[column * n + column + 1..];
        for (i, row) in below.chunks_exact_mut(n).enumerate() {
            let factor = row[column] * inverse;
            if factor != 0.0 {
                for (x, p) in row[column + 1..].iter_mut().zip(pivot_row) {
                    *x -= factor * p;
                }
                b[column + 1 + i] -= factor * b[column];
            }
        }
    }
    for row in (0..n).rev() {
        let known: f64 = a[row * n + row + 1..(row + 1) * n]
            .iter()
            .zip(&b[row + 1..])
            .map(|(x, y)| x * y)
            .sum();
        b[row] = (b[row] - known) / a[row * n + row];
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_solution_solves(n in 1..12_usize, seed in proptest::collection::vec(-1.0..1.0_f64, 156)) {
            let mut a: Vec<f64> = seed[..n * n].to_vec();
            for i in 0..n {
                a[i * n + i] += 4.0; // keeps the condition number small, so that the tolerance means something
            }
            let right: Vec<f64> = seed[144..144 + n].to_vec();
            let (kept, mut x) = (a.clone(), right.clone());
            solve_in_place(&mut a, &mut x).unwrap();
            for i in 0..n {
                let product: f64 = (0..n).map(|j| kept[i * n + j] * x[j]).sum();
                prop_assert!((product - right[i]).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_named() {
        let mut a = [1.0, 2.0, 2.0, 4.0];
        assert_eq!(
            solve_in_place(&mut a, &mut [1.0, 1.0]),
            Err(Singular { size: 2, column: 1 })
        );
        assert!(solve_in_place(&mut [f64::NAN], &mut [1.0]).is_err());
    }
}
